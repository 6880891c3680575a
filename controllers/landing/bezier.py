"""Bezier curves: a motion through control points in a given time."""

from math import comb

import numpy as np

from mjspace.algebra import times
from mjspace.contract import Array


def curve(points: Array, duration: float, s: Array) -> list[Array]:
    """Return a Bezier curve and its first four time derivatives at ``s`` (n,), each (n, 3) [m/s^k].

    ``points`` (k, 3) [m] are the control points, ``duration`` [s] the time of the whole curve, and
    ``s`` the fraction of it that has elapsed, 0 to 1.
    """
    found, corners = [], points
    for _ in range(5):
        found.append(times(corners.T, bernstein(len(corners) - 1, s)))
        corners = np.diff(corners, axis=0) * ((len(corners) - 1) / duration)
    return found


def bernstein(degree: int, s: Array) -> Array:
    """Return the Bernstein polynomials of a degree at ``s`` (n,), shape (n, degree + 1)."""
    terms = [comb(degree, k) * s**k * (1.0 - s) ** (degree - k) for k in range(degree + 1)]
    return np.stack(terms, axis=-1)
