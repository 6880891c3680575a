"""The double S: a turn from rest to rest in the least time, within limits of three derivatives.

L. Biagiotti and C. Melchiorri 2008, "Trajectory Planning for Automatic Machines and Robots",
section 3.4: seven segments of constant jerk, j, 0, -j, 0, -j, 0, j.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjspace.contract import Array

_SIGNS = np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0])


@dataclass(frozen=True)
class DoubleS:
    """A rise from 0 to 1 in seven segments of constant jerk."""

    jerk_time: float
    """Of each segment in which the acceleration changes [s]."""
    steady_time: float
    """Of each segment of constant acceleration [s]."""
    cruise_time: float
    """Of the segment of constant rate [s]."""

    @property
    def duration(self) -> float:
        """Of the whole [s]."""
        return 4.0 * self.jerk_time + 2.0 * self.steady_time + self.cruise_time

    @property
    def ends(self) -> Array:
        """When each segment ends [s], (7,)."""
        return np.cumsum(self._lengths)

    def slowed(self, factor: float) -> "DoubleS":
        """Return it with every segment ``factor`` times as long."""
        return DoubleS(
            factor * self.jerk_time, factor * self.steady_time, factor * self.cruise_time
        )

    def motion(self, time: Array) -> tuple[Array, Array, Array]:
        """Return the rise and its two derivatives at ``time`` [s] (n,) from its start.

        Held before it starts and after it ends.
        """
        begins, states = self._segments
        time = np.clip(time, 0.0, self.duration)
        of_each = np.clip(np.searchsorted(begins, time, side="right") - 1, 0, 6)
        since, jerk = time - begins[of_each], _SIGNS[of_each] * self.jerk
        rise, rate, bend = states[of_each].T
        return (
            rise + since * (rate + since * (0.5 * bend + since * jerk / 6.0)),
            rate + since * (bend + 0.5 * since * jerk),
            bend + since * jerk,
        )

    @property
    def jerk(self) -> float:
        """Of which the whole rises by 1 [1/s^3]: the peak rate is j Tj (Tj + Ts)."""
        ramp = self.jerk_time * (self.jerk_time + self.steady_time)
        return 1.0 / (ramp * (2.0 * self.jerk_time + self.steady_time + self.cruise_time))

    @cached_property
    def _segments(self) -> tuple[Array, Array]:
        """When each segment begins [s], (7,), and rise, rate and acceleration then, (7, 3)."""
        states = np.zeros((8, 3))
        for k, (t, jerk) in enumerate(zip(self._lengths, self.jerk * _SIGNS, strict=True)):
            rise, rate, bend = states[k]
            states[k + 1] = (
                rise + t * (rate + t * (0.5 * bend + t * jerk / 6.0)),
                rate + t * (bend + 0.5 * t * jerk),
                bend + t * jerk,
            )
        return np.concatenate([[0.0], self.ends[:-1]]), states[:7]

    @property
    def _lengths(self) -> Array:
        j, s, c = self.jerk_time, self.steady_time, self.cruise_time
        return np.array([j, s, j, c, j, s, j])


def quickest(angle: float, rate: float, acceleration: float, jerk: float) -> DoubleS:
    """Return the quickest turn by ``angle`` [rad] within limits [rad/s, rad/s^2, rad/s^3].

    All are greater than zero.
    """
    to_acceleration = acceleration / jerk
    if rate * jerk < acceleration**2:  # the rate is reached before the acceleration is
        ramp, steady = np.sqrt(rate / jerk), 0.0
    else:
        ramp, steady = to_acceleration, rate / acceleration - to_acceleration
    cruise = angle / rate - 2.0 * ramp - steady
    if cruise >= 0.0:
        return DoubleS(float(ramp), float(steady), float(cruise))
    if angle >= 2.0 * acceleration * to_acceleration**2:
        # angle = a (Tj + Ts) (2 Tj + Ts)
        whole = np.sqrt(0.25 * to_acceleration**2 + angle / acceleration)
        return DoubleS(to_acceleration, float(whole - 1.5 * to_acceleration), 0.0)
    return DoubleS(float((0.5 * angle / jerk) ** (1.0 / 3.0)), 0.0, 0.0)
