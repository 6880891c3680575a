"""The attitude at an instant from directions that are known in both body and inertial axes.

Markley and Crassidis 2014, "Fundamentals of Spacecraft Attitude Determination and Control",
chapter 5, with the quaternion of ``mjspace.attitude``, body to inertial, in place of theirs.
"""

from math import sqrt
from typing import Any

import numpy as np

from mjspace.algebra import cross, dot
from mjspace.attitude import normalize
from mjspace.contract import Array
from mjspace.gufunc import gufunc


def triad(body: Array, inertial: Array) -> Array:
    """Return the attitude (..., 4) by TRIAD from two directions, (..., 2, 3), of any length.

    The first is met exactly, of the second only the plane that it makes up with the first. Section
    5.1; Black 1964. Along one line they leave the attitude open: the result is not a number.
    """
    axes = []
    for vectors in (body, inertial):
        first = normalize(vectors[..., 0, :])
        across = normalize(cross(first, vectors[..., 1, :]))
        axes.append(np.stack([first, across, cross(first, across)], axis=-2))
    return q_method(axes[0], axes[1], np.ones_like(axes[0][..., 0]))


def q_method(body: Array, inertial: Array, weight: Array) -> Array:
    """Return the attitude (..., 4), scalar part not negative, that meets n directions best.

    It minimizes Wahba's loss, half the sum of weight_i |body_i - R^T inertial_i|^2: the eigenvector
    of Davenport's matrix K for its largest eigenvalue, section 5.3.1. ``body`` and ``inertial``,
    (..., n, 3), are unit vectors, ``weight`` (..., n) is not negative: best 1 / sigma_i^2, with
    sigma_i [rad] the error of each. A weight of 0 leaves a direction out. Jacobi's rotations find
    all four eigenvectors to rounding (Golub and Van Loan 2013, section 8.5), so that no attitude is
    singular, half turns included. Where the directions leave it open, by one line, the result is
    one of the best attitudes.
    """
    attitude: Array = _q_method.ufunc(body, inertial, weight, _FOUR)
    return attitude


def covariance(body: Array, weight: Array) -> Array:
    """Return that of the q method's attitude error [rad^2], body axes, (..., 3, 3).

    (sum of weight_i (1 - b_i b_i^T))^-1 with weights 1 / sigma_i^2 and unit vectors b (..., n, 3):
    section 5.5; Shuster and Oh 1981. Infinite or not a number where the directions are on one line.
    """
    outer = body[..., :, None] * body[..., None, :]
    information = np.sum(weight[..., None, None] * (np.eye(3) - outer), axis=-3)
    a, b, c = (information[..., k, :] for k in range(3))
    adjugate = np.stack([cross(b, c), cross(c, a), cross(a, b)], axis=-1)
    return adjugate / dot(a, cross(b, c))[..., None]


_FOUR = np.zeros(4)  # an operand from which the quaternion takes its shape


@gufunc(["void(f8[:, :], f8[:, :], f8[:], f8[:], f8[:])"], "(n,v),(n,v),(n),(q)->(q)")
def _q_method(body: Any, inertial: Any, weight: Any, _: Any, attitude: Any) -> None:
    K = np.zeros((4, 4))
    total = 0.0
    for k in range(weight.size):
        total += weight[k]
    scale = 1.0 / total if total > 0.0 else 1.0
    for k in range(weight.size):
        for i in range(3):
            for j in range(3):
                b = scale * weight[k] * inertial[k, i] * body[k, j]
                K[i + 1, j + 1] += b
                K[j + 1, i + 1] += b
                if i == j:
                    K[0, 0] += b
                    for other in range(3):
                        K[other + 1, other + 1] -= b
                elif (j - i) % 3 == 1:  # of B - B^T, the components of z
                    K[0, 3 - i - j + 1] -= b
                else:
                    K[0, 3 - i - j + 1] += b
    for i in range(3):
        K[i + 1, 0] = K[0, i + 1]
    V = np.eye(4)
    for _sweep in range(12):  # of which some five suffice: convergence is quadratic
        off = 0.0
        for p in range(3):
            for r in range(p + 1, 4):
                off += K[p, r] * K[p, r]
        if off < 1e-38:
            break
        for p in range(3):
            for r in range(p + 1, 4):
                if abs(K[p, r]) < 1e-20:  # of elements of order 1: tau would overflow
                    continue
                tau = (K[r, r] - K[p, p]) / (2.0 * K[p, r])
                t = 1.0 / (abs(tau) + sqrt(1.0 + tau * tau))
                if tau < 0.0:
                    t = -t
                c = 1.0 / sqrt(1.0 + t * t)
                s = t * c
                for k in range(4):
                    x, y = K[k, p], K[k, r]
                    K[k, p], K[k, r] = c * x - s * y, s * x + c * y
                for k in range(4):
                    x, y = K[p, k], K[r, k]
                    K[p, k], K[r, k] = c * x - s * y, s * x + c * y
                    x, y = V[k, p], V[k, r]
                    V[k, p], V[k, r] = c * x - s * y, s * x + c * y
    best = 0
    for k in range(1, 4):
        if K[k, k] > K[best, best]:
            best = k
    length = 0.0
    for k in range(4):
        length += V[k, best] * V[k, best]
    sign = 1.0 if V[0, best] >= 0.0 else -1.0
    for k in range(4):
        attitude[k] = sign * V[k, best] / sqrt(length)
