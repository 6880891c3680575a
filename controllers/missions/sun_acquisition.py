"""Safe mode: panels to the Sun by coarse Sun sensors and a gyro; wheels, which coils unload.

No attitude is needed. u = k a x s - c w turns the body axis a to the direction s of the Sun: the
derivative of V = k (1 - a.s) + w.I w / 2 is -c |w|^2, since s' = -w x s and the wheels' torque
cancels the gyroscopic one of their momentum. It rests where a = s, and where a = -s, which is a
saddle. In the shadow s is turned by the gyro. The turn about a is damped and its angle is free. All
arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross, dot, times, transpose
from mjspace.attitude import from_rotation_vector, normalize, rotate
from mjspace.contract import Array, DesiredMotion, Gains, Measurement, Unit, gain

from ..attitude.wheel_momentum import wheel_momentum
from ..magnetic.magnetic import Command, unload

FACES = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
"""Normals of a cell on each side of a box."""


class State(NamedTuple):
    """Memory of this law."""

    sun: Array
    """Estimated direction of the Sun, unit vector, body axes, (..., 3)."""
    found: Array
    """1.0 once the Sun has been seen, (..., 1)."""


class Signals(NamedTuple):
    """Signals of this law."""

    sun: Array
    """Estimated direction of the Sun, unit vector, body axes, (..., 3)."""
    lit: Array
    """1.0 where the cells see the Sun, (..., 1)."""
    sun_angle: Annotated[Array, Unit("rad")]
    """From the axis to the estimate [rad], (..., 1)."""
    h: Annotated[Array, Unit("N m s")]
    """Absolute momentum of the wheels [N m s], body axes, (..., 3)."""


@dataclass(frozen=True, kw_only=True)
class SunAcquisition(Gains):
    """u = k a x s - c w with wheels, unloaded by coils as in ``magnetic:MagneticUnloading``.

    It reads ``sun_cosines``, ``rate``, ``magnetic_field`` and the tachometers. Until the Sun is
    seen it damps the rate alone.
    """

    batched: ClassVar[bool] = True

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    wheel_axes: Array = gain(shape=("wheel", 3), form="unit vector")
    """Unit spin axes, body axes, one row for each wheel."""
    wheel_inertia: Array = gain("kg m^2", ("wheel",), at_least=0.0)
    """Axial inertia of each wheel."""
    axis: Array = gain(shape=(3,), form="unit vector", default=(1.0, 0.0, 0.0))
    """a, which is to point to the Sun, body axes."""
    normals: Array = gain(shape=("cell", 3), form="unit vector", default=FACES)
    """Of the coarse Sun sensor's cells, body axes: the sum of cosine times normal is taken for the
    Sun's direction, which it is for cells on opposite sides of three orthogonal axes."""
    least_light: float = gain(default=0.5, above=0.0, below=1.0)
    """Length of that sum below which it is not the Sun: it is the visible part of its disc."""
    correction: float = gain(default=0.1, above=0.0, at_most=1.0)
    """Part of its difference from the cells' that the estimate makes up in a period."""
    sun_gain: float = gain("N m", default=0.1, above=0.0)
    """k."""
    rate_gain: float = gain("N m s/rad", default=1.5, above=0.0)
    """c, the same on each axis."""
    unloading_gain: float = gain("1/s", default=1e-3, at_least=0.0)
    """Of the wheels' momentum perpendicular to the field."""

    def reset(self, measurement: Measurement, reference: DesiredMotion) -> State:
        """Return the state of a Sun that has not been seen."""
        none = np.zeros_like(measurement.rate)
        return State(none + self.axis, none[..., :1].copy())

    def step(
        self, state: State, time: float, measurement: Measurement, reference: DesiredMotion
    ) -> tuple[State, Command, Signals]:
        """Return (state, torque of the wheels on the bus and moment of the coils, signals)."""
        w = measurement.rate
        sun, lit = self._seen(state, measurement)
        found = np.maximum(state.found, lit)
        u = found * self.sun_gain * cross(self.axis, sun) - self.rate_gain * w
        h = wheel_momentum(self, measurement)
        dipole, coils = unload.ufunc(h, measurement.magnetic_field, self.unloading_gain)
        torque = u - cross(h, w) - coils  # -h' = u - h x w
        aside = cross(self.axis, sun)
        angle = np.arctan2(np.sqrt(dot(aside, aside)), dot(self.axis, sun))
        signals = Signals(sun.copy(), lit, angle, h)
        return State(sun, found), Command(torque, dipole), signals

    def _seen(self, state: State, measurement: Measurement) -> tuple[Array, Array]:
        """Return the estimated direction (..., 3), and 1.0 where the cells see the Sun (..., 1)."""
        turned = rotate(from_rotation_vector(-self.control_period * measurement.rate), state.sun)
        total = times(transpose(self.normals), measurement.sun_cosines)
        size = np.sqrt(dot(total, total))
        lit = np.where(size > self.least_light, 1.0, 0.0)
        measured = total / np.where(lit > 0.0, size, 1.0)
        part = lit * np.where(state.found > 0.0, self.correction, 1.0)
        return normalize(turned + part * (measured - turned)), lit
