"""Attitude control with a cluster of single-gimbal CMGs: PD+ and singularity-robust steering.

The attitude law is (5.9) of paper 001, in ``pd_plus``, with the momentum of bus and wheels. The
steering is that of ``cmg_steering``. The gimbals' speed loops are part of the actuator. All arrays
may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import times
from mjspace.contract import Array, Gains, GimbalRateCommand, Measurement, Reference, gain

from ..attitude import pd_plus
from . import cmg_steering


class State(NamedTuple):
    """Memory of this law: empty."""


class Signals(NamedTuple):
    """Signals of this law."""

    sigma_e: Array
    """Attitude error, modified Rodrigues parameters, (..., 3)."""
    s: Array
    """Composite error [rad/s], body axes, (..., 3)."""
    torque: Array
    """Commanded torque on the bus [N m], body axes, (..., 3)."""
    measure: Array
    """sqrt(det(A A^T)), zero in a singularity; at most 1.54 with four CMGs, (..., 1)."""
    damping: Array
    """lambda of the steering: zero where the commanded torque is exact, (..., 1)."""


@dataclass(frozen=True)
class ClusterGains(Gains):
    """What the laws of clusters share: the vehicle, its gyros, and the attitude law."""

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """M: of the whole vehicle, body axes."""
    gimbal_axes: Array = gain(shape=("cmg", 3), form="unit vector")
    """Unit vectors, body axes, (n, 3)."""
    spin_axes: Array = gain(shape=("cmg", 3), form="unit vector")
    """Of the wheels at gimbal angles of zero: unit vectors, body axes, (n, 3)."""
    wheel_inertia: Array = gain("kg m^2", ("cmg",), above=0.0)
    """Axial inertia of each wheel, (n,)."""
    attitude_gain: float = gain("1/s", default=1.0, above=0.0)
    """lam: with s = 0, sigma_e vanishes at this rate."""
    rate_gain: float = gain("N m s/rad", default=20.0, above=0.0)
    """Kc, the same on each axis."""

    def commanded_torque(
        self, measurement: Measurement, reference: Reference
    ) -> tuple[Array, Array, Array]:
        """Return the torque on the bus [N m], sigma_e and s [rad/s], each (..., 3), body axes."""
        angle, speed = measurement.gimbal_angle, measurement.wheel_speed
        wheel_momentum = cmg_steering.momentum(self.cluster, angle, speed)
        return pd_plus.commanded_torque(
            measurement.attitude,
            measurement.rate,
            times(self.inertia, measurement.rate) + wheel_momentum,
            reference,
            self.inertia,
            self._attitude_gains,
        )

    @cached_property
    def cluster(self) -> cmg_steering.Cluster:
        """The gyros."""
        return cmg_steering.Cluster(self.gimbal_axes, self.spin_axes, self.wheel_inertia)

    @cached_property
    def _attitude_gains(self) -> Array:
        return np.array([self.attitude_gain, self.rate_gain, 0.0, 1.0])


@dataclass(frozen=True)
class CmgCluster(ClusterGains):
    """PD+ commands the torque tau, the gimbals turn at d' = -A^T (A A^T + lambda E)^-1 tau / h0."""

    batched: ClassVar[bool] = True

    momentum: float = gain("N m s", default=2.0, above=0.0)
    """h0: momentum of one wheel, the scale of A."""
    measure_wanted: float = gain(default=0.5, above=0.0)
    """m0: below this measure the steering bounds the rates, and the torque is not exact."""
    damping: float = gain(default=0.01, at_least=0.0)
    """lambda0: lambda in a singularity. Zero is the pseudo-inverse, with unbounded rates."""
    dither: float = gain(default=0.3, at_least=0.0, below=0.5)
    """e0: amplitude of the dither of E, which leaves a locked direction. Below 0.5, E is positive
    definite."""
    null_gain: float = gain("1/s", default=0.0, at_least=0.0)
    """Gain of the null motion towards a larger measure."""
    gimbal_rate_limit: float = gain("rad/s", default=np.inf, above=0.0, at_most=np.inf)
    """Largest commanded rate; all rates are scaled together, so that the torque keeps its
    direction."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the empty state."""
        return State()

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, GimbalRateCommand, Signals]:
        """Return the state, the gimbal rates [rad/s] (..., n), and the signals."""
        angle, speed = measurement.gimbal_angle, measurement.wheel_speed
        torque, sigma_e, s = self.commanded_torque(measurement, reference)
        rate, measure, damping = cmg_steering.steer(
            self.cluster, torque, angle, speed, np.atleast_1d(time), self._steering_gains
        )
        fastest = np.max(np.abs(rate), axis=-1, keepdims=True)
        rate = rate / np.maximum(fastest / self.gimbal_rate_limit, 1.0)
        return state, GimbalRateCommand(rate), Signals(sigma_e, s, torque, measure, damping)

    @cached_property
    def _steering_gains(self) -> Array:
        steering = [self.momentum, self.measure_wanted, self.damping]
        return np.array([*steering, self.dither, self.null_gain])
