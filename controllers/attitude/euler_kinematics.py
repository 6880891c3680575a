"""Roll, pitch and yaw of R = Rz Ry Rx, their rates, and those of the body: w = W(x) x'.

Singular at a pitch of +-90 deg, where W has no inverse. All arrays may have leading axes.
"""

from math import pi

import numpy as np

from mjspace.algebra import components
from mjspace.attitude import to_euler_zyx
from mjspace.contract import Array


def unwrapped(q: Array, before: Array) -> Array:
    """Return the angles [rad] of a quaternion, (..., 3), each within half a turn of ``before``.

    The pitch, which stays within a quarter turn of zero, is left as it is for a ``before`` of an
    earlier instant.
    """
    angles = to_euler_zyx(q)
    return angles - 2.0 * pi * np.rint((angles - before) / (2.0 * pi))


def angle_rates(x: Array, w: Array) -> Array:
    """Return x' = W^-1(x) w [rad/s], (..., 3)."""
    (sr, cr, sp, cp), (p, q, r) = _sines(x), components(w)
    swing = sr * q + cr * r
    return np.concatenate([p + sp / cp * swing, cr * q - sr * r, swing / cp], axis=-1)


def torque_of(x: Array, F: Array) -> Array:
    """Return J^T F [N m], (..., 3), J = W^-1(x): the torque on the body that does the work F.x'."""
    (sr, cr, sp, cp), (a, b, c) = _sines(x), components(F)
    turning = (sp * a + c) / cp
    return np.concatenate([a, cr * b + sr * turning, cr * turning - sr * b], axis=-1)


def body_rate(x: Array, u: Array) -> Array:
    """Return W(x) u, (..., 3): the body rate [rad/s] of angle rates ``u``."""
    (sr, cr, sp, cp), (p, q, r) = _sines(x), components(u)
    return np.concatenate([p - sp * r, cr * q + sr * cp * r, cr * cp * r - sr * q], axis=-1)


def drift(x: Array, dx: Array, u: Array) -> Array:
    """Return W'(x, dx) u [rad/s^2], (..., 3): the change of W(x) u at a constant ``u``."""
    (sr, cr, sp, cp), (p, q, _), (_, b, c) = _sines(x), components(dx), components(u)
    return np.concatenate(
        [
            -cp * q * c,
            -sr * p * b + (cr * cp * p - sr * sp * q) * c,
            -cr * p * b - (sr * cp * p + cr * sp * q) * c,
        ],
        axis=-1,
    )


def _sines(x: Array) -> tuple[Array, Array, Array, Array]:
    """Return sine and cosine of roll, and of pitch, each (..., 1)."""
    roll, pitch = x[..., :1], x[..., 1:2]
    return np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
