"""A wanted motion from a table of attitudes: a smooth curve through them, with its derivatives."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from mjspace import attitude as att
from mjspace.contract import Array, Reference, gain


@dataclass(frozen=True)
class Table:
    """Attitudes at given times, on a curve of continuous acceleration that rests at its ends.

    Before the first time and after the last it holds them. The curve is a cubic spline through the
    quaternions, each with the sign nearer to the one before it, normalized: its path never jumps.
    """

    time: Array = gain("s", ("row",), form="increasing")
    """Increasing."""
    attitude: Array = gain(shape=("row", 4), form="quaternion")
    """Quaternion at each time, scalar first, body to inertial; normalized, of either sign."""

    def __post_init__(self) -> None:
        if len(self.time) < 2 or len(self.time) != len(self.attitude):
            raise ValueError(
                f"{len(self.time)} times for {len(self.attitude)} attitudes: "
                "give one for each, two or more"
            )
        for i in np.flatnonzero(~(np.diff(self.time) > 0.0)):
            raise ValueError(
                f"time[{i + 1}] {self.time[i + 1]:g} s is not after time[{i}] {self.time[i]:g} s"
            )
        for i in np.flatnonzero(~(np.linalg.norm(self.attitude, axis=-1) > 1e-6)):
            raise ValueError(f"attitude[{i}] has no direction: give a quaternion")

    def at(self, time: Array) -> Reference:
        """Return the curve at each ``time`` [s], shape (n,)."""
        inside = np.clip(time, self.time[0], self.time[-1])
        s, ds, dds = (self._spline(inside, order) for order in range(3))
        dds[inside != time] = 0.0
        # With q = s/|s|, the change of |s| is along q, so in the scalar part of conj(q) q' alone.
        square = np.sum(s * s, axis=-1, keepdims=True)
        growth = 2.0 * np.sum(s * ds, axis=-1, keepdims=True) / square
        rate = 2.0 * att.multiply(att.conjugate(s), ds)[..., 1:] / square
        bend = 2.0 * att.multiply(att.conjugate(s), dds)[..., 1:] / square
        return Reference(att.normalize(s), rate, bend - growth * rate)

    @cached_property
    def _spline(self) -> CubicSpline:
        q = att.normalize(self.attitude)
        turns = np.where(np.sum(q[1:] * q[:-1], axis=-1) < 0.0, -1.0, 1.0)
        signs = np.concatenate([[1.0], np.cumprod(turns)])
        return CubicSpline(self.time, signs[:, None] * q, bc_type="clamped")
