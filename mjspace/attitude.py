"""Attitude algebra: unit quaternions, rotation matrices, Euler angles and MRPs, over leading axes.

A quaternion is scalar first, Hamilton, and rotates body vectors into the inertial frame. Every
function takes any leading axes, broadcasts them, and leaves its arguments as they are. Formulas:
Markley and Crassidis 2014, "Fundamentals of Spacecraft Attitude Determination and Control",
section 2.9, with Hamilton's product in place of theirs.
"""

from typing import Any

import numpy as np

from mjspace.algebra import quaternion_product
from mjspace.contract import Array
from mjspace.gufunc import gufunc


def normalize(vector: Array) -> Array:
    """Return ``vector`` divided by its length along the last axis; a quaternion or any other."""
    unit: Array = vector / np.linalg.norm(vector, axis=-1, keepdims=True)
    return unit


def multiply(p: Array, q: Array) -> Array:
    """Return the product p q, shape (..., 4): the rotation q, then p."""
    return quaternion_product(p, q)


def conjugate(q: Array) -> Array:
    """Return the inverse of a unit quaternion, shape (..., 4)."""
    return np.concatenate([q[..., :1], -q[..., 1:]], axis=-1)


def rotate(q: Array, v: Array) -> Array:
    """Return the inertial components of ``v`` (..., 3), given in body axes: R(q) v."""
    return multiply(multiply(q, pure(v)), conjugate(q))[..., 1:]


def pure(v: Array) -> Array:
    """Return the quaternion [0, v], shape (..., 4), of a vector (..., 3)."""
    return np.concatenate([np.zeros_like(v[..., :1]), v], axis=-1)


def to_matrix(q: Array) -> Array:
    """Return R(q), shape (..., 3, 3), whose columns are the body axes in the inertial frame."""
    matrix: Array = _to_matrix.ufunc(q, _THREE)
    return matrix


def from_matrix(matrix: Array) -> Array:
    """Return the quaternion, scalar part not negative, of a rotation matrix (..., 3, 3).

    The matrix 4 q q^T is linear in R; of its rows, all along q, the longest loses no digits.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = (
        [matrix[..., i, j] for j in range(3)] for i in range(3)
    )
    outer = [
        [1 + xx + yy + zz, zy - yz, xz - zx, yx - xy],
        [zy - yz, 1 + xx - yy - zz, xy + yx, xz + zx],
        [xz - zx, xy + yx, 1 - xx + yy - zz, yz + zy],
        [yx - xy, xz + zx, yz + zy, 1 - xx - yy + zz],
    ]
    rows = np.stack([np.stack(row, axis=-1) for row in outer], axis=-2)
    longest = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(rows, longest[..., None, None], axis=-2)[..., 0, :]
    return _positive_scalar(normalize(row))


def from_rotation_vector(vector: Array) -> Array:
    """Return the quaternion (..., 4) of the turn by |vector| [rad] about ``vector`` (..., 3).

    It is continuous in ``vector``: a full turn gives -1, not 1.
    """
    half = 0.5 * np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * vector], axis=-1)


def to_rotation_vector(q: Array) -> Array:
    """Return the rotation vector (..., 3) [rad] of the shorter turn, no longer than pi."""
    q = _positive_scalar(q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    half: Array = np.arctan2(sine, q[..., :1])
    vector: Array = 2.0 * q[..., 1:] / np.sinc(half / np.pi)
    return vector


def from_euler_zyx(angles: Array) -> Array:
    """Return the quaternion (..., 4) of ``angles``, roll, pitch, yaw [rad] (..., 3).

    R = Rz(yaw) Ry(pitch) Rx(roll). It is continuous in the angles: a yaw of 2 pi gives -1, not 1.
    """
    half = 0.5 * angles
    (cr, cp, cy), (sr, sp, sy) = (
        [part[..., i] for i in range(3)] for part in (np.cos(half), np.sin(half))
    )
    return np.stack(
        [
            cy * cp * cr + sy * sp * sr,
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
        ],
        axis=-1,
    )


def to_euler_zyx(q: Array) -> Array:
    """Return roll, pitch, yaw [rad] (..., 3): roll and yaw in [-pi, pi], pitch in [-pi/2, pi/2].

    Yaw is taken after roll has been undone, so that at a pitch of 90 deg, where the matrix leaves
    roll to rounding, the two still make up the rotation together.
    """
    r = to_matrix(q)
    roll = np.arctan2(r[..., 2, 1], r[..., 2, 2])
    s, c = np.sin(roll), np.cos(roll)
    pitch = np.arctan2(-r[..., 2, 0], np.hypot(r[..., 2, 1], r[..., 2, 2]))
    yaw = np.arctan2(s * r[..., 0, 2] - c * r[..., 0, 1], c * r[..., 1, 1] - s * r[..., 1, 2])
    return np.stack([roll, pitch, yaw], axis=-1)


def rotation_angle(q: Array, p: Array) -> Array:
    """Return the angle [rad], 0 to pi, of the shorter turn between two attitudes, shape (...).

    The arc tangent keeps all digits near 0 and near pi, where an arc cosine loses half of them.
    """
    error = multiply(conjugate(p), q)
    angle: Array = 2.0 * np.arctan2(np.linalg.norm(error[..., 1:], axis=-1), np.abs(error[..., 0]))
    return angle


def tracking_error(q: Array, w: Array, q_ref: Array, w_ref: Array) -> tuple[Array, Array]:
    """Return (rotation vector [rad], rate [rad/s]) of a motion from the desired one, (..., 3) each.

    The vector is that of the shorter turn from the desired attitude ``q_ref`` to ``q``, the rate
    ``w`` less the desired one; ``w_ref`` is in the desired axes, all else in body axes.
    """
    turned = multiply(conjugate(q_ref), q)
    return to_rotation_vector(turned), w - rotate(conjugate(turned), w_ref)


def to_mrp(q: Array) -> Array:
    """Return the modified Rodrigues parameters q_v / (1 + q_0), shape (..., 3).

    Of the two sets it is the one with |sigma| <= 1: the shadow set when the scalar is negative.
    """
    q = _positive_scalar(q)
    return q[..., 1:] / (1.0 + q[..., :1])


def from_mrp(sigma: Array) -> Array:
    """Return the quaternion (..., 4) of modified Rodrigues parameters (..., 3), either set."""
    square: Array = np.sum(np.square(sigma), axis=-1, keepdims=True)
    return np.concatenate([1.0 - square, 2.0 * sigma], axis=-1) / (1.0 + square)


def _positive_scalar(q: Array) -> Array:
    sign: Array = np.copysign(1.0, q[..., :1])
    return sign * q


_THREE = np.zeros(3)  # an operand from which the matrix takes its shape


@gufunc(["void(f8[:], f8[:], f8[:, :])"], "(q),(v)->(v,v)")
def _to_matrix(q: Any, _: Any, matrix: Any) -> None:
    q0, q1, q2, q3 = q
    matrix[0, 0] = q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3
    matrix[0, 1] = 2.0 * (q1 * q2 - q0 * q3)
    matrix[0, 2] = 2.0 * (q1 * q3 + q0 * q2)
    matrix[1, 0] = 2.0 * (q1 * q2 + q0 * q3)
    matrix[1, 1] = q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3
    matrix[1, 2] = 2.0 * (q2 * q3 - q0 * q1)
    matrix[2, 0] = 2.0 * (q1 * q3 - q0 * q2)
    matrix[2, 1] = 2.0 * (q2 * q3 + q0 * q1)
    matrix[2, 2] = q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3
