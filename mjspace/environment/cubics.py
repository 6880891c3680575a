"""Vectors that are known beforehand as functions of time, as cubics that native callbacks read."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.environment.compiled import compiled

SIZE = 13
"""Numbers of a cubic: when it begins [s], then the factors (3) of the third power of the time
since, of the second, of the first, and of one."""


@compiled
def component(cubic: Any, axis: int, since: float) -> float:
    """Return one component of a ``cubic`` (``SIZE``) at the time ``since`` it begins [s]."""
    slope = (cubic[1 + axis] * since + cubic[4 + axis]) * since + cubic[7 + axis]
    return float(slope * since + cubic[10 + axis])


def value_of(cubics: Array, time: Array) -> Array:
    """Return the vectors at ``time`` [s] (...) of ``cubics`` (..., ``SIZE``), (..., 3)."""
    since = time[..., None] - cubics[..., :1]
    cubic, square, slope, value = (cubics[..., i : i + 3] for i in (1, 4, 7, 10))
    vector: Array = ((cubic * since + square) * since + slope) * since + value
    return vector


@dataclass(frozen=True)
class Cubics:
    """A vector as one cubic of time after another."""

    spacing: float
    """How long each holds [s], from time zero on; a whole number of control periods."""
    pieces: Array
    """(n, ``SIZE``)."""

    def rows(self, time: Array | float) -> Array:
        """Return the cubic that holds from ``time`` [s] on, of shape (...), as (..., ``SIZE``)."""
        # time is a multiple of the control period, but for rounding
        last = np.floor(np.asarray(time) / self.spacing + 1e-6).astype(int)
        found: Array = self.pieces[np.clip(last, 0, len(self.pieces) - 1)]
        return found

    def at(self, time: Array | float) -> Array:
        """Return the vector at ``time`` [s] of shape (...), as (..., 3)."""
        return value_of(self.rows(time), np.asarray(time))


def through(
    value: Callable[[Array], Array], duration: float, control: float, spacing: float
) -> Cubics:
    """Return the cubic spline through ``value`` for ``duration`` [s].

    ``value`` returns vectors (n, 3) at times (n,) [s]. Its samples are ``spacing`` [s] apart at
    most, and a whole number of ``control`` periods [s].
    """
    from scipy.interpolate import CubicSpline  # which takes 0.2 s

    spacing = control * max(1.0, math.floor(spacing / control))
    time: Array = spacing * np.arange(max(4.0, math.ceil(duration / spacing) + 2.0))
    spline = CubicSpline(time, value(time))
    factors = np.moveaxis(spline.c, 0, 1).reshape(-1, SIZE - 1)
    return Cubics(spacing, np.column_stack([time[:-1], factors]))
