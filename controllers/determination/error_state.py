"""What filters of small errors share: propagation by a gyro, and correction by measurements.

Of Kalman filters whose attitude error is a small rotation in body axes: true = estimated times
from_rotation_vector(error).
"""

import numpy as np

from mjspace.algebra import dot, times
from mjspace.attitude import conjugate, from_rotation_vector, multiply, to_rotation_vector
from mjspace.contract import Array


def attitude_error(estimated: Array, true: Array) -> Array:
    """Return the rotation vector [rad] from the ``estimated`` attitude to the true, body axes."""
    return to_rotation_vector(multiply(conjugate(estimated), true))


def mean_rate(last: Array, now: Array, bias: Array) -> Array:
    """Return the mean rate [rad/s] between two samples of a gyro, less its ``bias``, (..., 3)."""
    rate: Array = 0.5 * (last + now) - bias
    return rate


def turned(attitude: Array, rate: Array, h: Array) -> Array:
    """Return the ``attitude`` (..., 4) after ``h`` [s] (..., 1) at a constant body ``rate``."""
    return multiply(attitude, from_rotation_vector(h * rate))


def corrected(
    x: Array, P: Array, H: Array, innovation: Array, noise: float | Array, fresh: Array
) -> tuple[Array, Array, Array]:
    """Return the errors (..., n), P and the sum of squares of m measurements, where ``fresh``.

    ``H`` (m, n) or (..., m, n) is their sensitivity to the errors, ``innovation`` (..., m)
    measured less predicted, ``noise`` the standard deviation of each; ``fresh`` (..., 1). The sum
    (..., 1) is of the innovations in units of their standard deviations, the normalized innovation
    squared; 0 where not ``fresh``. Sola, "Quaternion kinematics for the error-state Kalman filter",
    2017, section 6.1, one number at a time, since their noises are independent: no matrix is
    inverted.
    """
    square = np.zeros_like(x[..., :1])
    for i in range(H.shape[-2]):
        row = H[..., i, :]
        PH = times(P, row)
        variance = dot(row, PH) + noise**2
        K = np.where(fresh, PH / variance, 0.0)
        left = innovation[..., i : i + 1] - dot(row, x)
        x, P = x + K * left, P - K[..., :, None] * PH[..., None, :]
        square = square + np.where(fresh, left**2 / variance, 0.0)
    return x, P, square
