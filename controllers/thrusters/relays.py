"""Relays that fire on/off thrusters for each axis: the base of the phase-plane laws.

A relay is electronics, not software: it is evaluated in every integration step, in ``inner``, and
switches half a step late on average, independently of the control period. All arrays may have
leading vehicle axes; m is the number of axes.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace import attitude as att
from mjspace.contract import Array, Gains, Measurement, PulseCommand, Reference, Unit, gain

from ..attitude.turn import turn
from .allocation import effect, pattern


class State(NamedTuple):
    """Memory of a law."""

    memory: Array
    """Memory of each axis, (..., m, k); the law's docstring defines its k columns."""


class Aim(NamedTuple):
    """Command of a control instant: the desired motion for the relays, and their first on-times."""

    attitude: Array
    """Of the desired axes, as a quaternion to inertial axes, (..., 4)."""
    rate: Array
    """Of the desired axes, in these axes [rad/s], (..., 3)."""
    acceleration: Annotated[Array, Unit("rad/s^2")]
    """Of the desired axes [rad/s^2], (..., 3): held until the next control instant."""
    on_time: Array
    """Of each thruster in the integration step that begins [s], (..., n)."""


class Signals(NamedTuple):
    """Signals of a law."""

    angle: Annotated[Array, Unit("rad")]
    """a: angle from the desired to the measured attitude about each axis [rad], (..., m)."""
    angle_rate: Annotated[Array, Unit("rad/s")]
    """a' [rad/s], (..., m)."""
    firing: Array
    """Sense of the thrusters' torque about each axis: 1.0, -1.0, or 0.0 when off, (..., m)."""


@dataclass(frozen=True, kw_only=True)
class PhasePlane(Gains, ABC):
    """Base of the phase-plane laws: thrusters for both senses of each axis."""

    batched: ClassVar[bool] = True

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """Of the whole vehicle, about its centre of mass, body axes."""
    axes: Array = gain(shape=(None, 3), default=np.eye(3), form="unit vector")
    """Controlled axes, unit vectors in body axes, (m, 3)."""
    thruster_positions: Array = gain("m", ("thruster", 3))
    """From the centre of mass, body axes, (n, 3)."""
    thruster_directions: Array = gain(shape=("thruster", 3), form="unit vector")
    """Of the force on the vehicle, body axes, (n, 3)."""
    thruster_force: Array = gain("N", ("thruster",), above=0.0)
    """Of each, (n,)."""
    control_period: float = gain("s", above=0.0)
    inner_period: float = gain("s", above=0.0)
    """Time for which a relay's state is held: the integration step."""

    def __post_init__(self) -> None:
        super().__post_init__()
        torques = self._effects[:3] @ self._patterns.swapaxes(1, 2)
        one, other = np.einsum("mi,sim->sm", self.axes, torques)
        if not np.allclose(one, -other, rtol=1e-9):
            raise ValueError(
                f"the thrusters' torques about the axes differ by sense: {one} N m and {other} N m"
            )

    @cached_property
    def acceleration(self) -> Array:
        """U of each axis [rad/s^2], (m,)."""
        return self._acceleration_by(self._patterns[0])

    @cached_property
    def _effects(self) -> Array:
        return effect(self.thruster_positions, self.thruster_directions, self.thruster_force)

    @cached_property
    def _patterns(self) -> Array:
        """The thrusters' shares for a torque along each axis, and against it, (2, m, n)."""
        return self._patterns_of(self._effects)

    def _patterns_of(self, effects: Array) -> Array:
        """Return such shares of thrusters with these ``effects`` (6, n)."""
        ways = ([pattern(way * axis, effects) for axis in self.axes] for way in (1.0, -1.0))
        return np.array(list(ways))

    def _acceleration_by(self, patterns: Array) -> Array:
        """Return the angular acceleration about each axis by its ``patterns`` (m, n), (m,)."""
        torques = self._effects[:3] @ patterns.T
        moments = np.einsum("mi,ij,mj->m", self.axes, self.inertia, self.axes)
        found: Array = np.einsum("mi,im->m", self.axes, torques) / moments
        return found

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the initial memory."""
        return State(self._recall(*turn(measurement, reference, self.axes)))

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, Aim, Signals]:
        """Return the desired motion for the relays, and the signals of this instant."""
        angle, rate = turn(measurement, reference, self.axes)
        _, firing, duration = self._decide(state.memory, angle, rate)
        still = np.zeros_like(measurement.rate)
        aim = Aim(
            np.zeros_like(measurement.attitude) + reference.attitude,
            still + reference.rate,
            still + reference.acceleration,
            self._on_time(firing, duration),
        )
        return state, aim, Signals(angle, rate, firing)

    def inner(
        self, state: State, time: float, command: Aim, measurement: Measurement
    ) -> tuple[State, PulseCommand]:
        """Return each thruster's on-time in the integration step that begins."""
        since = time - self.control_period * np.floor(time / self.control_period + 1e-9)
        gained = since * command.acceleration
        turned = att.from_rotation_vector(since * (command.rate + 0.5 * gained))
        turns = np.any(
            (command.rate != 0.0) | (command.acceleration != 0.0), axis=-1, keepdims=True
        )
        attitude = np.where(turns, att.multiply(command.attitude, turned), command.attitude)
        rate = np.where(turns, command.rate + gained, command.rate)
        desired = Reference(attitude, rate, command.acceleration)
        memory, firing, duration = self._decide(
            state.memory, *turn(measurement, desired, self.axes)
        )
        return State(memory), PulseCommand(self._on_time(firing, duration))

    def _on_time(self, firing: Array, duration: Array) -> Array:
        forth = np.where(firing > 0.0, duration, 0.0)[..., None] * self._patterns[0]
        back = np.where(firing < 0.0, duration, 0.0)[..., None] * self._patterns[1]
        on_time: Array = np.minimum((forth + back).sum(axis=-2), self.inner_period)
        return on_time

    def _recall(self, angle: Array, rate: Array) -> Array:
        """Return the initial memory, (..., m, k)."""
        return np.zeros((*angle.shape, 1))

    @abstractmethod
    def _decide(self, memory: Array, angle: Array, rate: Array) -> tuple[Array, Array, Array]:
        """Return (memory (..., m, k), firing sense 1, 0 or -1 (..., m), on-time [s] (..., m))."""

    def _whole(self, firing: Array) -> tuple[Array, Array, Array]:
        """Return the decision to fire for the whole integration step, with the sense as memory."""
        return firing[..., None], firing, np.full_like(firing, self.inner_period)
