"""Pointing at another spacecraft from where it is measured, without a reference or an attitude.

u = k a x s + c (w_s - w) turns the body axis a to the direction s of the other spacecraft, as
``missions.sun_acquisition`` turns one to the Sun. w_s is the rate of s: the derivative of s in body
axes is (w_s - w) x s, so that s x s' has all of w_s - w but the part along s, where the turn is
damped alone. The wheels' torque cancels the gyroscopic one of their momentum. It follows s within
I w_s' / k. All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross, dot
from mjspace.contract import Array, DesiredMotion, Gains, Measurement, TorqueCommand, Unit, gain

from ..attitude.wheel_momentum import wheel_momentum


class Signals(NamedTuple):
    """Signals of this law."""

    pointing_angle: Annotated[Array, Unit("rad")]
    """From the axis to the other spacecraft, as measured [rad], (..., 1)."""
    line_of_sight_rate: Annotated[Array, Unit("rad/s")]
    """w_s less the body's rate, across the line of sight, as measured [rad/s], (..., 3)."""
    distance: Annotated[Array, Unit("m")]
    """As measured [m], (..., 1)."""


@dataclass(frozen=True, kw_only=True)
class TargetPointing(Gains):
    """u = k a x s + c (w_s - w) with wheels, from relative navigation and a gyro.

    It reads ``rate``, the tachometers, and ``camera_position`` and ``camera_velocity``: the other
    spacecraft's position and its derivative, body axes.
    """

    batched: ClassVar[bool] = True

    wheel_axes: Array = gain(shape=("wheel", 3), form="unit vector")
    """Unit spin axes, body axes, one row for each wheel."""
    wheel_inertia: Array = gain("kg m^2", ("wheel",), at_least=0.0)
    """Axial inertia of each wheel."""
    axis: Array = gain(shape=(3,), form="unit vector", default=(0.0, 0.0, 1.0))
    """a, as of a camera, body axes."""
    pointing_gain: float = gain("N m", default=0.5, above=0.0)
    """k."""
    rate_gain: float = gain("N m s/rad", default=4.0, above=0.0)
    """c, the same on each axis."""

    def reset(self, measurement: Measurement, reference: DesiredMotion) -> None:
        """Return None: it remembers nothing."""

    def step(
        self, state: None, time: float, measurement: Measurement, reference: DesiredMotion
    ) -> tuple[None, TorqueCommand, Signals]:
        """Return (None, torque of the wheels on the bus, signals)."""
        w = measurement.rate
        place = measurement.camera_position
        speed = measurement.camera_velocity
        square = dot(place, place)
        distance = np.sqrt(square)
        sight = place / distance
        across = cross(place, speed) / square  # s x s'
        turn = across - sight * dot(sight, w)
        aside = cross(self.axis, sight)
        u = self.pointing_gain * aside + self.rate_gain * turn
        angle = np.arctan2(np.sqrt(dot(aside, aside)), dot(self.axis, sight))
        torque = u + cross(w, wheel_momentum(self, measurement))
        return None, TorqueCommand(torque), Signals(angle, across, distance)
