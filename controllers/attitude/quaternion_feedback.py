"""Lyapunov quaternion feedback and rate damping with reaction wheels: u = -(k q_e + c w).

R. Vazquez, "Tema 8: Control activo de la actitud", Universidad de Sevilla 2016 (paper 004). q_e is
the vector of the error quaternion conj(q_ref) q, for a reference at rest. u and the wheels' h are
those of ``linear_quadratic``: h' = -u + h x w. The path of q is kept continuous from the sign that
is measured first, so that no law minds which one a sensor reports later. All arrays may have
leading vehicle axes.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.contract import Array, Gains, Measurement, Reference, TorqueCommand, gain

from . import wheel_feedback_kernels as kernels


class State(NamedTuple):
    """Memory of these laws."""

    attitude: Array
    """Last measured quaternion, with the sign that keeps its path continuous, (..., 4)."""
    sign: Array
    """1.0 or -1.0: that of k, (..., 1)."""
    path: Array
    """Angle turned through so far, whichever way: the integral of |w| [rad], (..., 1)."""
    impulse: Array
    """Integral of |u| so far [N m s], (..., 1)."""


class Signals(NamedTuple):
    """What these laws show."""

    error: Array
    """conj(q_ref) q, on the continuous path, (..., 4)."""
    k: Array
    """In force, with its sign [N m], (..., 1)."""
    u: Array
    """Torque wanted on the bus, that of h x w apart [N m], body axes, (..., 3)."""
    path: Array
    """As in the state, (..., 1)."""
    impulse: Array
    """As in the state, (..., 1)."""


@dataclass(frozen=True)
class _OnWheels(Gains, ABC):
    """What the laws of this module have in common."""

    batched: ClassVar[bool] = True

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    wheel_axes: Array = gain(shape=("wheel", 3), form="unit vector")
    """Unit spin axes, body axes, one row for each wheel."""
    wheel_inertia: Array = gain("kg m^2", ("wheel",), at_least=0.0)
    """Axial inertia of each wheel."""
    rate_gain: float = gain("N m s/rad", default=6.0, above=0.0)
    """c, the same on each axis."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the state that begins with the sign measured, nothing turned or spent yet."""
        lead = measurement.rate.shape[:-1]
        none = np.zeros((*lead, 1))
        sign = self._sign(np.sum(reference.attitude * measurement.attitude, axis=-1, keepdims=True))
        return State(measurement.attitude.copy(), sign, none, none.copy())

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, Signals]:
        """Return the next state, the torque on the bus, -h', and what it is made of."""
        seen, rate = measurement.attitude, measurement.rate
        wheel_speed = measurement.wheel_speed
        wheels = (self.wheel_axes, self.wheel_inertia)
        torque, error, k, u, *after = kernels.quaternion(
            seen, rate, reference.attitude, wheel_speed, *state, *wheels, self._gains
        )
        shown = Signals(error, k, u, state.path.copy(), state.impulse.copy())
        return State(*after), TorqueCommand(torque), shown

    @abstractmethod
    def _law(self) -> tuple[float, float]:
        """Return k and the hysteresis, of which an infinite one never changes its sign."""

    def _sign(self, scalar: Array) -> Array:
        """Return the sign of k at the start (..., 1), where q_e has the ``scalar`` (..., 1)."""
        return np.ones_like(scalar)

    @cached_property
    def _gains(self) -> Array:
        k, hysteresis = self._law()
        return np.array([k, self.rate_gain, hysteresis, self.control_period])


@dataclass(frozen=True)
class Fixed(_OnWheels):
    """u = -(k q_e + c w): of one attitude's two quaternions it wants 1 if k > 0, -1 if k < 0.

    From the wrong one it unwinds: it turns on by up to 360 deg, away from where it already is. That
    one is a saddle, left at the positive root s of I s^2 + c s - |k|/2; the other is asymptotically
    stable, by I s^2 + c s + |k|/2.
    """

    attitude_gain: float = gain("N m", default=1.0)
    """k, on the quaternion: the stiffness is half of it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.attitude_gain == 0.0:
            raise ValueError("attitude_gain: got 0, should be any other number")

    def _law(self) -> tuple[float, float]:
        return self.attitude_gain, inf


@dataclass(frozen=True)
class Switched(_OnWheels):
    """k = k0 sgn(q0), with sgn(0) = 1 and a hysteresis (erratum 7): the shorter way, always.

    With sgn(0) = 0, as often programmed, it would be content half a turn away; without hysteresis
    the noise of a star tracker would switch it to and fro there.
    """

    attitude_gain: float = gain("N m", default=1.0, above=0.0)
    """k0, on the quaternion: the stiffness is half of it."""
    hysteresis: float = gain(default=0.05, at_least=0.0, below=1.0)
    """How far past zero q0 must be for the sign to change."""

    def _law(self) -> tuple[float, float]:
        return self.attitude_gain, self.hysteresis

    def _sign(self, scalar: Array) -> Array:
        return np.where(scalar < 0.0, -1.0, 1.0)


@dataclass(frozen=True)
class RateDamping(_OnWheels):
    """u = -c w: the rates vanish, the wheels take the momentum, any attitude is left (erratum 6).

    Of the linear axis, it is I w0 / c that is turned through.
    """

    def _law(self) -> tuple[float, float]:
        return 0.0, inf
