"""Lyapunov quaternion feedback and rate damping with reaction wheels: u = -(k q_e + c w).

R. Vazquez, "Tema 8: Control activo de la actitud", Universidad de Sevilla 2016 (paper 004). q_e is
the vector part of the error quaternion conj(q_ref) q, for a reference at rest. u and the wheels' h
are as in ``linear_quadratic``: h' = -u + h x w. The path of q is kept continuous from the first
measurement on, so that the sign that a sensor reports later does not matter. All arrays may have
leading vehicle axes.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from math import inf
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross, dot
from mjspace.attitude import conjugate, multiply
from mjspace.contract import Array, Gains, Measurement, Reference, TorqueCommand, gain

from .wheel_momentum import wheel_momentum


class State(NamedTuple):
    """Memory of these laws."""

    attitude: Array
    """Last measured quaternion, with the sign that keeps its path continuous, (..., 4)."""
    sign: Array
    """Sign of k: 1.0 or -1.0, (..., 1)."""
    path: Array
    """Length of the path so far: the integral of |w| [rad], (..., 1)."""
    impulse: Array
    """Integral of |u| so far [N m s], (..., 1)."""


class Signals(NamedTuple):
    """Signals of these laws."""

    error: Array
    """conj(q_ref) q, on the continuous path, (..., 4)."""
    k: Array
    """Present gain with its sign [N m], (..., 1)."""
    u: Array
    """Commanded torque on the bus without h x w [N m], body axes, (..., 3)."""
    path: Array
    """As in the state, (..., 1)."""
    impulse: Array
    """As in the state, (..., 1)."""


@dataclass(frozen=True)
class _WheelLaw(Gains, ABC):
    """Base of the laws of this module."""

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
        """Return the initial state, with the measured sign of q."""
        lead = measurement.rate.shape[:-1]
        none = np.zeros((*lead, 1))
        sign = self._sign(np.sum(reference.attitude * measurement.attitude, axis=-1, keepdims=True))
        return State(measurement.attitude.copy(), sign, none, none.copy())

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, Signals]:
        """Return the next state, the torque on the bus, -h', and the signals."""
        q, w, T = measurement.attitude, measurement.rate, self.control_period
        k0, hysteresis = self._law()
        q = np.where(dot(q, state.attitude) < 0.0, -q, q)
        error = multiply(conjugate(reference.attitude), q)
        switches = state.sign * error[..., :1] < -hysteresis  # erratum 7
        sign = np.where(switches, -state.sign, state.sign)
        k = k0 * sign
        u = -(k * error[..., 1:] + self.rate_gain * w)
        torque = u - cross(wheel_momentum(self, measurement), w)  # -h' = u - h x w
        path = state.path + T * np.sqrt(dot(w, w))
        impulse = state.impulse + T * np.sqrt(dot(u, u))
        signals = Signals(error, k, u, state.path.copy(), state.impulse.copy())
        return State(q, sign, path, impulse), TorqueCommand(torque), signals

    @abstractmethod
    def _law(self) -> tuple[float, float]:
        """Return k [N m] and the hysteresis; an infinite one keeps the sign of k."""

    def _sign(self, scalar: Array) -> Array:
        """Return the initial sign of k (..., 1) for the error quaternion's ``scalar`` (..., 1)."""
        return np.ones_like(scalar)


@dataclass(frozen=True)
class Fixed(_WheelLaw):
    """u = -(k q_e + c w) with constant k: stabilizes the error quaternion 1 if k > 0, -1 if k < 0.

    From the other one, which is the same attitude, it unwinds: it rotates by up to 360 deg. That
    equilibrium is a saddle, left at the positive root s of I s^2 + c s - |k|/2; the stabilized one
    is asymptotically stable, by I s^2 + c s + |k|/2.
    """

    attitude_gain: float = gain("N m", default=1.0)
    """k, on the quaternion: the stiffness per angle is half of it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.attitude_gain == 0.0:
            raise ValueError("attitude_gain: got 0, should not be zero")

    def _law(self) -> tuple[float, float]:
        return self.attitude_gain, inf


@dataclass(frozen=True)
class Switched(_WheelLaw):
    """k = k0 sgn(q0), with sgn(0) = 1 and a hysteresis (erratum 7): always the shorter way.

    With sgn(0) = 0, a common implementation, the torque would vanish at an error of 180 deg;
    without hysteresis the noise of a star tracker would cause repeated switching there.
    """

    attitude_gain: float = gain("N m", default=1.0, above=0.0)
    """k0, on the quaternion: the stiffness per angle is half of it."""
    hysteresis: float = gain(default=0.05, at_least=0.0, below=1.0)
    """Value that q0 has to pass beyond zero before the sign changes."""

    def _law(self) -> tuple[float, float]:
        return self.attitude_gain, self.hysteresis

    def _sign(self, scalar: Array) -> Array:
        return np.where(scalar < 0.0, -1.0, 1.0)


@dataclass(frozen=True)
class RateDamping(_WheelLaw):
    """u = -c w: the rates vanish, the wheels take the momentum, the attitude is free (erratum 6).

    An axis with an initial rate w0 turns by I w0 / c.
    """

    def _law(self) -> tuple[float, float]:
        return 0.0, inf
