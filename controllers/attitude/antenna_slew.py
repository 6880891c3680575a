"""An antenna, or any instrument on a gimbal, is slewed while reaction wheels hold the bus.

A gimbal's motor turns the bus the other way: it puts -J a on it, J the inertia about the hinge and
a the acceleration. Fed forward to the wheels, this leaves the bus at rest, and the wheels take the
momentum J r of a gimbal of rate r. All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from mjspace.algebra import times
from mjspace.contract import Array, Measurement, Reference, Unit, gain

from .linear_quadratic import Regulator, Signals


class Command(NamedTuple):
    """Command to wheels and gimbals."""

    torque: Annotated[Array, Unit("N m")]
    """Torque of the wheels on the bus, body axes [N m], (..., 3)."""
    gimbal_rate: Annotated[Array, Unit("rad/s")]
    """Relative to the bus [rad/s], (..., g)."""


@dataclass(frozen=True, kw_only=True)
class AntennaSlew(Regulator):
    """The gimbals turn from rest to rest by a quintic of time; a regulator holds the bus.

    Each gimbal is carried by the bus itself, and what it turns is balanced about its hinge.
    """

    gimbal_axes: Array = gain(shape=("gimbal", 3), form="unit vector")
    """Of the hinges, body axes, (g, 3)."""
    gimbal_inertia: Array = gain("kg m^2", ("gimbal",), at_least=0.0)
    """J: of all that each hinge turns, about its axis, (g,)."""
    control_period: float = gain("s", above=0.0)
    angle: Array | float = gain("rad", ("gimbal",), one_for_all=True)
    """By which all turn, or each, (g,)."""
    start_time: float = gain("s", default=0.0, at_least=0.0)
    """When they begin to."""
    duration: float = gain("s", above=0.0)
    """From rest to rest."""
    feed_forward: float = gain(default=1.0, at_least=0.0, at_most=1.0)
    """Share of the gimbals' reaction that the wheels are told; 0 leaves it to the feedback."""

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, Any, Signals]:
        """Return the regulator's state and signals, and the commands to wheels and gimbals.

        Rate and acceleration are the means of the control period that begins, so that the angle at
        its end is right.
        """
        state, wheels, signals = super().step(state, time, measurement, reference)
        now, later = self._share(time), self._share(time + self.control_period)
        rate = (later[0] - now[0]) / self.control_period * self.angle
        acceleration = (later[1] - now[1]) / self.control_period * self.angle
        reaction = times(self.gimbal_axes.T, self.gimbal_inertia * acceleration)
        torque = wheels.torque + self.feed_forward * reaction
        still = np.zeros((*measurement.rate.shape[:-1], len(self.gimbal_axes)))
        return state, Command(torque, still + rate), signals

    def _share(self, time: float) -> tuple[Any, Any]:
        """Return the share of the angle that is due at ``time`` [s], and its derivative [1/s]."""
        s = np.clip((time - self.start_time) / self.duration, 0.0, 1.0)
        turned = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        return turned, 30.0 * s**2 * (1.0 - s) ** 2 / self.duration
