"""Spinning satellites on thrusters: spin-up, and precession along a rhumb line.

A pulse in each revolution, always at the same angle of the spin from the direction of the Sun,
moves the spin axis along a line that meets the Sun's meridians under one angle: a rhumb line (Wertz
1978, "Spacecraft Attitude Determination and Control", section 19.3). All arrays may have leading
vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross, dot, times
from mjspace.attitude import normalize, rotate
from mjspace.contract import Array, Gains, Measurement, PulseCommand, Reference, Unit, gain

from .allocation import effect, pattern


@dataclass(frozen=True, kw_only=True)
class _Spinner(Gains):
    """What the two laws share."""

    batched: ClassVar[bool] = True

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """Of the whole vehicle, about its centre of mass, body axes."""
    axis: Array = gain(shape=(3,), default=(0.0, 0.0, 1.0), form="unit vector")
    """Of the spin, a principal axis, body axes."""
    thruster_positions: Array = gain("m", ("thruster", 3))
    """From the centre of mass, body axes, (n, 3)."""
    thruster_directions: Array = gain(shape=("thruster", 3), form="unit vector")
    """Of the force on the vehicle, body axes, (n, 3)."""
    thruster_force: Array = gain("N", ("thruster",), above=0.0)
    """Of each, (n,)."""
    control_period: float = gain("s", above=0.0)

    @cached_property
    def _effects(self) -> Array:
        return effect(self.thruster_positions, self.thruster_directions, self.thruster_force)

    def _pattern(self, axis: Array) -> tuple[Array, float]:
        """Return the shares of the thrusters that turn about ``axis``, and their torque [N m]."""
        shares = pattern(axis, self._effects)
        return shares, float(axis @ self._effects[:3] @ shares)


class SpinUpState(NamedTuple):
    """Memory of the law: empty."""


class SpinUpSignals(NamedTuple):
    """Signals of the law."""

    spin: Annotated[Array, Unit("rad/s")]
    """Rate about the axis [rad/s], (..., 1)."""


@dataclass(frozen=True, kw_only=True)
class SpinUp(_Spinner):
    """Fires about the axis until the rate is reached: J (spin_rate - w) / torque seconds in all."""

    spin_rate: float = gain("rad/s", above=0.0)

    def reset(self, measurement: Measurement, reference: Reference) -> SpinUpState:
        """Return the empty state."""
        return SpinUpState()

    def step(
        self, state: SpinUpState, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[SpinUpState, PulseCommand, SpinUpSignals]:
        """Return the on-times of this period, and the rate."""
        spin = dot(measurement.rate, self.axis)
        shares, torque = self._along
        needed = float(self.axis @ self.inertia @ self.axis) * (self.spin_rate - spin) / torque
        on_time = np.clip(needed, 0.0, self.control_period) * shares
        return state, PulseCommand(on_time), SpinUpSignals(spin)

    @cached_property
    def _along(self) -> tuple[Array, float]:
        return self._pattern(self.axis)


class State(NamedTuple):
    """Memory of ``RhumbLine``: the plan, and what of it is done."""

    heading: Array
    """About the axis, from the meridian away from the Sun to its path [rad], (..., 1)."""
    left: Array
    """Pulses that are still to be fired, (..., 1)."""
    quiet: Array
    """Until the next may begin [s], half a revolution after the last, (..., 1)."""


class Signals(NamedTuple):
    """Signals of ``RhumbLine``."""

    off_target: Annotated[Array, Unit("rad")]
    """Angle from the momentum to the desired spin axis [rad], (..., 1)."""
    nutation: Annotated[Array, Unit("rad")]
    """Angle from the momentum to the spin axis [rad], (..., 1)."""
    sun_angle: Annotated[Array, Unit("rad")]
    """From the direction of the Sun to the momentum [rad], (..., 1)."""
    left: Array
    """Pulses that are still to be fired, (..., 1)."""


@dataclass(frozen=True, kw_only=True)
class RhumbLine(_Spinner):
    """Turns the spin axis to the reference's, by one pulse in each revolution.

    A pulse of ``pulse`` seconds turns the momentum by 2 tau sin(w pulse / 2) / (J w^2). Heading and
    number of pulses follow, at the start, from the rhumb line: with the angle from the Sun t and
    the azimuth f about it, tan(heading) = change of f / change of ln tan(t/2), and its length is
    the change of t / cos(heading). Pulses begin in the control period nearest to their phase, with
    valves that stay open over periods: ``burns = "to_the_end"``.
    """

    sun: Array = gain(shape=(3,), default=(1.0, 0.0, 0.0), form="unit vector")
    """Direction of the Sun, inertial axes; neither the initial nor the desired axis is along it."""
    torque_axis: Array = gain(shape=(3,), default=(1.0, 0.0, 0.0), form="unit vector")
    """Of the torque that is fired, body axes, across the spin axis."""
    pulse: float = gain("s", above=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if abs(float(self.torque_axis @ self.axis)) > 1e-9:
            raise ValueError(
                f"torque_axis: got {self.torque_axis.tolist()}, should be across the spin axis, "
                f"{self.axis.tolist()}"
            )

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the plan of the whole precession."""
        momentum, spin = self._momentum(measurement)
        target = self._target(measurement, reference)
        one, other = self._polar(momentum), self._polar(target)
        azimuth = np.arctan2(
            dot(cross(momentum, target), self.sun + 0.0 * momentum),
            dot(momentum, target) - np.cos(one) * np.cos(other),
        )
        north = np.log(np.tan(0.5 * other) / np.tan(0.5 * one))
        same = np.abs(north) < 1e-9
        mean_sine = np.where(same, np.sin(one), (other - one) / np.where(same, 1.0, north))
        length = mean_sine * np.sqrt(azimuth**2 + north**2)
        left = np.rint(length / self.turn_of_a_pulse(spin))
        return State(np.arctan2(azimuth, north), left, np.zeros_like(left))

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, PulseCommand, Signals]:
        """Return what is left of the plan, the on-times of this period, and the signals."""
        momentum, spin = self._momentum(measurement)
        q = measurement.attitude
        ahead = self.sun - dot(momentum, self.sun + 0.0 * momentum) * momentum
        away = -normalize(ahead)  # along the meridian, away from the Sun
        along = np.cos(state.heading) * away + np.sin(state.heading) * cross(momentum, away)
        torque = rotate(q, self.torque_axis + 0.0 * momentum)
        lag = np.arctan2(dot(cross(torque, along), momentum), dot(torque, along))
        # The middle of the pulse is where the torque is along the path.
        wait = lag / spin - 0.5 * self.pulse
        half = 0.5 * self.control_period
        fires = (wait >= -half) & (wait < half) & (state.quiet <= 0.0) & (state.left > 0.5)
        on_time = np.where(fires, self.pulse, 0.0) * self._across[0]
        axis = rotate(q, self.axis + 0.0 * momentum)
        signals = Signals(
            _angle(momentum, self._target(measurement, reference)),
            _angle(momentum, axis),
            self._polar(momentum),
            state.left.copy(),
        )
        after = State(
            state.heading.copy(),
            np.where(fires, state.left - 1.0, state.left),
            np.where(fires, np.pi / spin, np.maximum(state.quiet - self.control_period, 0.0)),
        )
        return after, PulseCommand(on_time), signals

    def turn_of_a_pulse(self, spin: Array) -> Array:
        """Return the angle [rad] by which a pulse turns the momentum, at a ``spin`` [rad/s]."""
        moment = float(self.axis @ self.inertia @ self.axis)
        turned: Array = 2.0 * self._across[1] * np.sin(0.5 * spin * self.pulse) / (moment * spin**2)
        return turned

    @cached_property
    def _across(self) -> tuple[Array, float]:
        return self._pattern(self.torque_axis)

    def _momentum(self, measurement: Measurement) -> tuple[Array, Array]:
        """Return the direction of the momentum, inertial axes (..., 3), and the spin [rad/s]."""
        own = times(self.inertia, measurement.rate)
        return normalize(rotate(measurement.attitude, own)), dot(measurement.rate, self.axis)

    def _target(self, measurement: Measurement, reference: Reference) -> Array:
        return rotate(reference.attitude, self.axis) + 0.0 * measurement.rate

    def _polar(self, direction: Array) -> Array:
        return _angle(direction, self.sun + 0.0 * direction)


def _angle(one: Array, other: Array) -> Array:
    """Return the angle between unit vectors [rad], (..., 1)."""
    across = cross(one, other)
    angle: Array = np.arctan2(np.sqrt(dot(across, across)), dot(one, other))
    return angle
