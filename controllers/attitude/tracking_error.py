"""The error of attitude and rate against a reference, by the shorter turn."""

from typing import NamedTuple

import numpy as np

from mjspace.algebra import components, times, transpose
from mjspace.attitude import conjugate, multiply, to_matrix
from mjspace.contract import Array, Reference


class TrackingError(NamedTuple):
    """Of the measured motion, and the desired one in body axes."""

    quaternion: Array
    """From desired to body axes, of the shorter turn, (..., 4)."""
    sigma_e: Array
    """The same in modified Rodrigues parameters, |sigma_e| <= 1, (..., 3)."""
    w_e: Array
    """Measured less desired rate [rad/s], body axes, (..., 3)."""
    wb: Array
    """R_e^T wd [rad/s]."""
    dwd_b: Array
    """R_e^T wd' [rad/s^2]."""


def tracking_error(attitude: Array, rate: Array, reference: Reference) -> TrackingError:
    """Return the error of a measured ``attitude`` (..., 4) and ``rate`` (..., 3) [rad/s]."""
    error = shorter(multiply(conjugate(reference.attitude), attitude))
    sigma_e = error[..., 1:] / (1.0 + error[..., :1])
    R_eT = transpose(to_matrix(error))
    wb = times(R_eT, reference.rate)
    return TrackingError(error, sigma_e, rate - wb, wb, times(R_eT, reference.acceleration))


def shorter(error: Array) -> Array:
    """Return the error quaternion or its negative, of the smaller angle, (..., 4).

    At 180 deg its scalar is zero and both signs are valid: the sign is then chosen by the vector,
    so that q and -q give the same result.
    """
    w, x, y, z = components(error)
    first = np.where(w != 0.0, w, np.where(x != 0.0, x, np.where(y != 0.0, y, z)))
    return np.where(first < 0.0, -error, error)
