"""Gains over time: a cubic spline that is evaluated at a measured time, and so can be compiled."""

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from mjspace.contract import Array
from mjspace.gufunc import gufunc


class GainTable:
    """Matrices (n, i, j) at equally spaced times (n,), from zero on [s]; the last holds after."""

    def __init__(self, time: Array, gains: Array) -> None:
        spline = CubicSpline(time, gains)
        self._step = np.diff(time).mean()
        self._coefficients = np.moveaxis(spline.c, 1, 0).copy()  # (n - 1, 4, i, j)

    def at(self, time: Array | float) -> Array:
        """Return the matrix (i, j) at a ``time`` [s]."""
        matrix: Array = _at.ufunc(self._coefficients, self._step, time)
        return matrix


@gufunc(["void(f8[:, :, :, :], f8, f8, f8[:, :])"], "(n,k,i,j),(),()->(i,j)")
def _at(coefficients: Any, step: Any, time: Any, matrix: Any) -> None:
    pieces = coefficients.shape[0]
    now = min(max(time, 0.0), pieces * step)
    piece = min(int(now / step), pieces - 1)
    x = now - piece * step
    a, b, c, d = coefficients[piece]
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            matrix[i, j] = ((a[i, j] * x + b[i, j]) * x + c[i, j]) * x + d[i, j]
