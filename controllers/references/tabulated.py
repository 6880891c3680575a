"""A desired motion from a table of attitudes: a smooth curve through them, with its derivatives."""

import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline

from mjspace import attitude as att
from mjspace.contract import TICK, Array, Gains, Reference, gain

_SLOW = 0.05  # of the largest rate: what counts as rest at an end of the table


@dataclass(frozen=True)
class Table(Gains):
    """A smooth curve through tabulated attitudes, with continuous acceleration.

    The curve is a cubic spline through the quaternions, normalized; each quaternion takes the sign
    nearer to the one before, so that the path is continuous. By default the motion is at rest at
    the first and the last time and holds these attitudes before and after; a warning reports rows
    that move there. With other ``ends`` the spline is not-a-knot and keeps the rate of its rows.
    """

    time: Array = gain("s", ("row",), form="increasing")
    """Times of the rows, increasing."""
    attitude: Array = gain(shape=("row", 4), form="quaternion")
    """Quaternion at each time, scalar first, body to inertial, of either sign."""
    ends: Literal["rest", "continue", "refuse"] = "rest"
    """At the first and last time: "rest"; "continue" to rotate on at the rate reached there; or
    "refuse" times beyond them."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.ends not in _ENDS:
            raise ValueError(f"ends: got {self.ends!r}, should be one of {', '.join(_ENDS)}")
        if len(self.time) < 2:
            raise ValueError(f"time: got {len(self.time)} rows, should be two or more")
        if self.ends == "rest" and len(self.time) > 3:
            self._warn_of_braking()

    def at(self, time: Array) -> Reference:
        """Return the curve at each ``time`` [s], shape (n,).

        Raises:
            ValueError: a time is outside the table and ``ends`` is "refuse".
        """
        inside = np.clip(time, self.time[0], self.time[-1])
        beyond = time - inside
        if self.ends == "refuse" and (outside := np.abs(beyond) > TICK).any():
            raise ValueError(
                f"time: the table has {self.time[0]:g} to {self.time[-1]:g} s, without "
                f'{time[outside][0]:g} s: add rows, or set ends to "rest" or "continue"'
            )
        attitude, rate, acceleration = _motion(self._spline, inside)
        acceleration[beyond != 0.0] = 0.0
        if self.ends == "continue":
            turned = att.from_rotation_vector(beyond[:, None] * rate)
            attitude = np.where(beyond[:, None] == 0.0, attitude, att.multiply(attitude, turned))
        return Reference(attitude, rate, acceleration)

    @cached_property
    def _spline(self) -> CubicSpline:
        return self._curve("clamped" if self.ends == "rest" else "not-a-knot")

    def _curve(self, boundary: str) -> CubicSpline:
        q = att.normalize(self.attitude)
        turns = np.where(np.sum(q[1:] * q[:-1], axis=-1) < 0.0, -1.0, 1.0)
        signs = np.concatenate([[1.0], np.cumprod(turns)])
        return CubicSpline(self.time, signs[:, None] * q, bc_type=boundary)

    def _warn_of_braking(self) -> None:
        _, rate, _ = _motion(self._curve("not-a-knot"), self.time)
        speed = np.linalg.norm(rate, axis=-1)
        for row in (0, -1):
            if speed[row] > _SLOW * speed.max():
                warnings.warn(
                    f"the table's rows turn at {speed[row]:.3g} rad/s at {self.time[row]:g} s, "
                    'where the reference rests: set ends to "continue" or "refuse"',
                    stacklevel=2,
                )


_ENDS = ("rest", "continue", "refuse")


def _motion(spline: CubicSpline, time: Array) -> tuple[Array, Array, Array]:
    """Return attitude (n, 4), rate [rad/s] and acceleration [rad/s^2] (n, 3) on the spline."""
    s, ds, dds = (spline(time, order) for order in range(3))
    # With q = s/|s|, a change of |s| affects the scalar part of conj(q) q' alone.
    square = np.sum(s * s, axis=-1, keepdims=True)
    growth = 2.0 * np.sum(s * ds, axis=-1, keepdims=True) / square
    rate = 2.0 * att.multiply(att.conjugate(s), ds)[..., 1:] / square
    bend = 2.0 * att.multiply(att.conjugate(s), dds)[..., 1:] / square
    return att.normalize(s), rate, bend - growth * rate
