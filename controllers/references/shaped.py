"""Slews of flexible satellites: bang-bang, and shaped so that a mode is left at rest.

N. C. Singer, W. P. Seering, "Preshaping command inputs to reduce system vibration", ASME Journal of
Dynamic Systems, Measurement, and Control 112 (1990): a command convolved with impulses whose
vibrations of a mode cancel each other leaves none of it.
"""

from dataclasses import dataclass
from math import exp, pi, sqrt
from typing import Literal

import numpy as np

from mjspace import attitude as att
from mjspace.contract import Array, Gains, Reference, gain

from .references import turned


@dataclass(frozen=True)
class BangBang(Gains):
    """A rest-to-rest turn about the eigenaxis, the shorter way, of constant angular acceleration.

    It speeds up in the first half of its time and slows down in the second. A ``shaper`` convolves
    it with impulses half a damped period of the mode apart: two for "ZV", no vibration at that
    frequency, or three for "ZVD", nor a change of the vibration with the frequency. It then speeds
    up harder, so that the whole still takes ``duration``.
    """

    attitude: Array = gain(shape=(4,), form="quaternion")
    """Final attitude: quaternion, scalar first, body to inertial; normalized."""
    duration: float = gain("s", above=0.0)
    """From rest to rest, the shaper included."""
    shaper: Literal["none", "ZV", "ZVD"] = "none"
    frequency: float = gain("Hz", default=1.0, above=0.0)
    """Of the mode that the shaper leaves at rest, undamped; with the bus free, where its attitude
    control is slow against it."""
    damping_ratio: float = gain(default=0.0, at_least=0.0, below=1.0)
    """Of that mode."""
    start_time: float = gain("s", default=0.0)
    """Start of the slew; until then ``start_attitude`` is held."""
    start_attitude: Array = gain(shape=(4,), default=(1.0, 0.0, 0.0, 0.0), form="quaternion")
    """Initial attitude: quaternion, scalar first, body to inertial; normalized."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.shaper not in _REPEATS:
            raise ValueError(f"shaper: got {self.shaper!r}, should be none, ZV or ZVD")
        if self._times[-1] >= self.duration:
            raise ValueError(
                f"duration: got {self.duration:g} s, should be more than the shaper's, "
                f"{self._times[-1]:.6g} s"
            )

    def at(self, time: Array) -> Reference:
        """Return the slew at each ``time`` [s]; held before it starts and after it ends."""
        start, end = att.normalize(self.start_attitude), att.normalize(self.attitude)
        vector = att.to_rotation_vector(att.multiply(att.conjugate(start), end))
        since = (time - self.start_time)[:, None] - self._times
        parts = _bang_bang(since, self.duration - self._times[-1])
        fraction, rate, acceleration = (part @ self._impulses for part in parts)
        return turned(start, vector, (fraction, rate, acceleration))

    @property
    def _times(self) -> Array:
        """When the impulses act [s], from the first on, (k,)."""
        half = 0.5 / (self.frequency * sqrt(1.0 - self.damping_ratio**2))
        return half * np.arange(_REPEATS[self.shaper] + 1.0)

    @property
    def _impulses(self) -> Array:
        """Their sizes, whose sum is 1, (k,)."""
        decay = exp(-pi * self.damping_ratio / sqrt(1.0 - self.damping_ratio**2))
        sizes = np.ones(1)
        for _ in range(_REPEATS[self.shaper]):
            sizes = np.convolve(sizes, [1.0, decay]) / (1.0 + decay)
        return sizes


_REPEATS = {"none": 0, "ZV": 1, "ZVD": 2}
"""How often a shaper is two impulses convolved."""


def _bang_bang(time: Array, duration: float) -> tuple[Array, Array, Array]:
    """Return a rise from 0 to 1 of constant acceleration, then deceleration, and derivatives."""
    s = np.clip(time / duration, 0.0, 1.0)
    left = 1.0 - s
    speeds_up = s < 0.5
    fraction = np.where(speeds_up, 2.0 * s * s, 1.0 - 2.0 * left * left)
    moves = (time >= 0.0) & (time < duration)
    sign = np.where(moves, np.where(speeds_up, 1.0, -1.0), 0.0)
    return fraction, 4.0 * np.minimum(s, left) / duration, 4.0 * sign / duration**2
