"""The torque of a satellite as a product of known columns and its unknown parameters.

Paper 002, (2.40): H a - p x w = Y theta, where theta has the six numbers m11 m12 m13 m22 m23 m33 of
H [kg m^2] and, if the momentum is unknown as well, its three inertial components hI [N m s].
"""

import numpy as np

from mjspace.algebra import cross, transpose
from mjspace.attitude import to_matrix
from mjspace.contract import Array


def momentum_columns(w: Array, q: Array) -> Array:
    """Return S(w) R(q)^T, (..., 3, 3), of (2.40): w x each inertial axis, a column in body axes."""
    return transpose(cross(w[..., None, :], to_matrix(q)))


_W6 = np.array([[0, 1, 2, 3, 3, 3], [3, 0, 3, 1, 2, 3], [3, 3, 0, 3, 1, 2]])
"""Where a1 a2 a3 0 stand in W6(a), with W6(a) [m11 m12 m13 m22 m23 m33] = M a."""


def inertia_columns(a: Array) -> Array:
    """Return W6(a), (..., 3, 6)."""
    return np.concatenate([a, np.zeros_like(a[..., :1])], axis=-1)[..., _W6]


def regressor(a: Array, block: Array) -> Array:
    """Return Y = [W6(a), block], (2.40), (..., 3, 9)."""
    return np.concatenate([inertia_columns(a), block], axis=-1)
