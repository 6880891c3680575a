"""Pointing by magnetic moments: all three axes by coils alone, or beside a wheel of momentum bias.

Coils have no torque along the field. Of a torque u that a law asks for, the moment m = (B x u)/B^2
gives what is across the field, m x B = u - b (b.u), b = B/|B|. Along an inclined orbit the field
turns, and with gains that act over an orbit or more the mean of it counts, u less b b^T u averaged:
M. Lovera and A. Astolfi, Spacecraft attitude control using magnetic actuators, Automatica 40, 2004;
E. Silani and M. Lovera, Magnetic spacecraft attitude control: a survey and some new results,
Control Engineering Practice 13, 2005.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross, dot
from mjspace.attitude import normalize
from mjspace.contract import Array, Gains, Measurement, Reference, Unit, gain

from ..attitude.tracking_error import tracking_error
from ..attitude.wheel_momentum import wheel_momentum
from .magnetic import Command, DipoleCommand


class State(NamedTuple):
    """Memory of these laws: empty."""


class Signals(NamedTuple):
    """Signals of these laws."""

    sigma_e: Array
    """Error in modified Rodrigues parameters, a quarter of the angle, (..., 3)."""
    w_e: Annotated[Array, Unit("rad/s")]
    """Error of the rate, body axes [rad/s], (..., 3)."""
    asked: Annotated[Array, Unit("N m")]
    """Torque asked of the coils, u, body axes [N m], (..., 3)."""
    lost: Annotated[Array, Unit("N m")]
    """Of it what lies along the field, b.u [N m], (..., 1)."""


class BiasSignals(NamedTuple):
    """Signals of ``MomentumBias``."""

    sigma_e: Array
    """Error in modified Rodrigues parameters, a quarter of the angle, (..., 3)."""
    w_e: Annotated[Array, Unit("rad/s")]
    """Error of the rate, body axes [rad/s], (..., 3)."""
    asked: Annotated[Array, Unit("N m")]
    """Torque asked of the coils, u, body axes [N m], (..., 3)."""
    lost: Annotated[Array, Unit("N m")]
    """Of it what lies along the field, b.u [N m], (..., 1)."""
    momentum: Annotated[Array, Unit("N m s")]
    """Of the wheel along its axis, absolute [N m s], (..., 1)."""


def moment_for(u: Array, field: Array) -> tuple[Array, Array]:
    """Return m = (B x u)/B^2 [A m^2], (..., 3), and b.u [N m], (..., 1), which it cannot give.

    ``u`` [N m] and ``field`` [T] are (..., 3), in the same axes.
    """
    square = dot(field, field)
    return cross(field, u) / square, dot(field, u) / np.sqrt(square)


@dataclass(frozen=True)
class MagneticPointing(Gains):
    """u = -(k q_e + c w_e): attitude and rate by coils alone, of which the mean over an orbit acts.

    It is stable where that mean is, which is shown for gains that are small beside the orbit's: k/I
    and (c/I)^2 beside n^2. Larger ones may be faster, and may not: the axis along the field is free
    at each instant. Where the gravity gradient holds the attitude too, it is added to k.
    """

    batched: ClassVar[bool] = True

    attitude_gain: float = gain("N m", at_least=0.0)
    """k: of the vector part of the error quaternion, half the angle."""
    rate_gain: float = gain("N m s/rad", above=0.0)
    """c."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the empty state."""
        return State()

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, DipoleCommand, Signals]:
        """Return the state, the coils' moment [A m^2] and the signals."""
        error = tracking_error(measurement.attitude, measurement.rate, reference)
        u = -(self.attitude_gain * error.quaternion[..., 1:] + self.rate_gain * error.w_e)
        dipole, lost = moment_for(u, measurement.magnetic_field)
        return state, DipoleCommand(dipole), Signals(error.sigma_e, error.w_e, u, lost)


@dataclass(frozen=True)
class MomentumBias(Gains):
    """A wheel of momentum bias along the orbit's normal holds pitch, coils do the rest.

    The wheel's torque is -(k q_e + c w_e) about an axis a; its momentum h makes roll and yaw
    stiff. The coils are asked for -c_x w_e across a, which damps the nutation and, since the orbit
    turns roll into yaw, the error of both, for -k_x q_e there, and for -k_h (h - h_0) a, which
    takes the wheel back to its bias. M. J. Sidi, Spacecraft Dynamics and Control, Cambridge 1997,
    chapter 8; for the coils K. T. Alfriend, Magnetic attitude control system for dual-spin
    satellites, AIAA Journal 13, 1975.
    """

    batched: ClassVar[bool] = True

    wheel_axes: Array = gain(shape=("wheel", 3), form="unit vector")
    """Unit spin axes, body axes, one row for each wheel; one along a is enough."""
    wheel_inertia: Array = gain("kg m^2", ("wheel",), at_least=0.0)
    """Axial inertia of each wheel."""
    pitch_axis: Array = gain(shape=(3,), form="direction")
    """a: along which the wheels have their bias, body axes; normalized."""
    bias_momentum: float = gain("N m s")
    """h_0: of the wheels along a. Along the orbit's normal, the sense of the orbit, it makes
    an attitude that turns with the orbit stable; the other way it has to be held."""
    pitch_gain: float = gain("N m", above=0.0)
    """k: of half the angle about a."""
    pitch_rate_gain: float = gain("N m s/rad", above=0.0)
    """c."""
    cross_gain: float = gain("N m", at_least=0.0)
    """k_x: of half the angle across it."""
    cross_rate_gain: float = gain("N m s/rad", at_least=0.0)
    """c_x."""
    unloading_gain: float = gain("1/s", at_least=0.0)
    """k_h."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the empty state."""
        return State()

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, Command, BiasSignals]:
        """Return the state, the wheel's torque and the coils' moment, and the signals."""
        axis = normalize(self.pitch_axis)
        error = tracking_error(measurement.attitude, measurement.rate, reference)
        turn, rate = error.quaternion[..., 1:], error.w_e
        turned, turning = dot(axis, turn), dot(axis, rate)
        torque = -(self.pitch_gain * turned + self.pitch_rate_gain * turning) * axis
        momentum = dot(axis, wheel_momentum(self, measurement))
        across = self.cross_gain * (turn - turned * axis)
        across = across + self.cross_rate_gain * (rate - turning * axis)
        u = -across - self.unloading_gain * (momentum - self.bias_momentum) * axis
        dipole, lost = moment_for(u, measurement.magnetic_field)
        shown = BiasSignals(error.sigma_e, rate, u, lost, momentum)
        return state, Command(torque, dipole), shown
