"""Attitude control with on/off thrusters on all axes: a PD torque, allocated, in pulses.

A PD torque on the quaternion's vector part, plus the torque of the reference motion, is allocated
to thrusters by non-negative least squares and fired in pulses, whose remainders are carried over to
the next control period. With an ``attitude_gain`` of zero it damps the rate alone. The torque is
from Vázquez 2016 (paper 004), the rest is ``allocation``. All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace import attitude as att
from mjspace.contract import Array, Gains, Measurement, PulseCommand, Reference, Unit, gain

from ..attitude.turn import turn
from .allocation import effect, pulses, share, within


class State(NamedTuple):
    """Memory of the law."""

    carry: Array
    """On-time of each thruster that is carried over [s], (..., n)."""


class Signals(NamedTuple):
    """Signals of the law."""

    angle: Annotated[Array, Unit("rad")]
    """Rotation vector from the desired to the measured attitude [rad], body axes, (..., 3)."""
    angle_rate: Annotated[Array, Unit("rad/s")]
    """Measured less desired rate [rad/s], body axes, (..., 3)."""
    torque: Array
    """Commanded torque [N m], body axes, (..., 3)."""
    shares: Array
    """Fraction of the period that each thruster should be on, (..., n)."""


@dataclass(frozen=True)
class PulsedPd(Gains):
    """tau = -kp sin(|a|/2) a/|a| - kd w_e + H alpha + w x H w, by thrusters."""

    batched: ClassVar[bool] = True

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """H: of the whole vehicle, about its centre of mass, body axes."""
    thruster_positions: Array = gain("m", ("thruster", 3))
    """From the centre of mass, body axes, (n, 3)."""
    thruster_directions: Array = gain(shape=("thruster", 3), form="unit vector")
    """Of the force on the vehicle, body axes, (n, 3)."""
    thruster_force: Array = gain("N", ("thruster",), above=0.0)
    """Of each, (n,)."""
    control_period: float = gain("s", above=0.0)
    attitude_gain: float = gain("N m", at_least=0.0)
    """kp: the stiffness for small angles is half of it."""
    rate_gain: float = gain("N m s/rad", at_least=0.0)
    """kd, the same on each axis."""
    thruster_minimum_on: Array | float = gain(
        "s", ("thruster",), default=0.0, at_least=0.0, one_for_all=True
    )
    """Shorter pulses are not fired but carried over; of all, or of each, (n,)."""
    force_weight: float = gain("m", default=1.0, at_least=0.0)
    """Weight of an unwanted net force relative to a torque error; zero ignores the force."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the initial state: nothing is carried over."""
        none = np.zeros((*measurement.rate.shape[:-1], len(self.thruster_force)))
        return State(none)

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, PulseCommand, Signals]:
        """Return the next state, the on-times of this period, and the signals."""
        angle, slip = turn(measurement, reference, np.eye(3))
        torque = self._torque(angle, slip, measurement.rate, reference)
        shares, on_time, carry = self._pulses(state.carry, torque, np.zeros_like(torque))
        return State(carry), PulseCommand(on_time), Signals(angle, slip, torque, shares)

    def _pulses(self, carry: Array, torque: Array, force: Array) -> tuple[Array, Array, Array]:
        """Return shares, on-times and what is carried over [s], (..., n), body axes [N m, N]."""
        desired = np.concatenate([torque, self.force_weight * force], axis=-1)
        shares, _ = within(share(desired, self._effects))
        period, shortest = self.control_period, self.thruster_minimum_on
        return shares, *pulses(shares, carry, period, shortest)

    def _torque(self, angle: Array, slip: Array, rate: Array, reference: Reference) -> Array:
        half = 0.5 * np.linalg.norm(angle, axis=-1, keepdims=True)
        vector = 0.5 * np.sinc(half / np.pi) * angle
        to_body = att.from_rotation_vector(-angle)
        # The derivative of the desired rate's components in the rotating body axes.
        acceleration = att.rotate(to_body, reference.acceleration) - np.cross(rate, rate - slip)
        torque: Array = (
            -self.attitude_gain * vector
            - self.rate_gain * slip
            + self._times_inertia(acceleration)
            + np.cross(rate, self._times_inertia(rate))
        )
        return torque

    def _times_inertia(self, vector: Array) -> Array:
        # BLAS may round one vehicle's product differently in a batch than alone.
        product: Array = (self.inertia * vector[..., None, :]).sum(axis=-1)
        return product

    @cached_property
    def _effects(self) -> Array:
        weights = np.repeat([1.0, self.force_weight], 3)
        found: Array = weights[:, None] * effect(
            self.thruster_positions, self.thruster_directions, self.thruster_force
        )
        return found
