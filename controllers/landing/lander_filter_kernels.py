"""The arithmetic of the lander's error-state filter, compiled.

Errors and estimates are in the order of ``lander_filter.FilterState``. Sums are plain loops, so
that a vehicle's numbers are bit for bit the same alone and in a batch.
"""

# mypy: disable-error-code="no-untyped-call"
from math import cos, sin, sqrt
from typing import Any

import numpy as np
from numba import njit

from mjspace.gufunc import gufunc


@njit
def _rotated(q: Any, x: Any, y: Any, z: Any) -> Any:
    """Return q times the rotation by the rotation vector (x, y, z) [rad]."""
    angle = max(sqrt(x * x + y * y + z * z), 1e-150)  # not zero: 0 / 0 would warn
    share = sin(0.5 * angle) / angle
    c, x, y, z = cos(0.5 * angle), share * x, share * y, share * z
    return (
        q[0] * c - q[1] * x - q[2] * y - q[3] * z,
        q[0] * x + q[1] * c + q[2] * z - q[3] * y,
        q[0] * y - q[1] * z + q[2] * c + q[3] * x,
        q[0] * z + q[1] * y - q[2] * x + q[3] * c,
    )


@njit
def _matrix(q: Any) -> Any:
    """Return R(q), body to world."""
    a, b, c, d = q
    r = np.empty((3, 3))
    r[0, 0], r[0, 1], r[0, 2] = 1 - 2 * (c * c + d * d), 2 * (b * c - a * d), 2 * (b * d + a * c)
    r[1, 0], r[1, 1], r[1, 2] = 2 * (b * c + a * d), 1 - 2 * (b * b + d * d), 2 * (c * d - a * b)
    r[2, 0], r[2, 1], r[2, 2] = 2 * (b * d - a * c), 2 * (c * d + a * b), 1 - 2 * (b * b + c * c)
    return r


@njit
def _transition(r: Any, f: Any, w: Any, h: Any) -> Any:
    """Return the errors' transition matrix (15, 15) over a time ``h`` [s], to first order.

    ``r`` is R(q), ``f`` the specific force [m/s^2] and ``w`` the rate [rad/s], body axes.
    """
    phi = np.eye(15)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        phi[i, 3 + i] = h
        phi[6 + i, 12 + i] = -h
        # theta' = -w x theta - b_g, v' = -R (f x theta) - R b_a.
        phi[6 + i, 6 + j], phi[6 + i, 6 + k] = h * w[k], -h * w[j]
        for n in range(3):
            phi[3 + n, 6 + i] = -h * (r[n, j] * f[k] - r[n, k] * f[j])
            phi[3 + n, 9 + i] = -h * r[n, i]
    return phi


@njit
def _propagate(P: Any, phi: Any, numbers: Any, h: Any) -> None:
    """Replace P by phi P phi^T + Q."""
    half = np.zeros((15, 15))
    for i in range(15):
        for k in range(15):
            if phi[i, k] != 0.0:
                for j in range(15):
                    half[i, j] += phi[i, k] * P[k, j]
    P[:] = 0.0
    for j in range(15):
        for k in range(15):
            if phi[j, k] != 0.0:
                for i in range(15):
                    P[i, j] += half[i, k] * phi[j, k]
    force, gyro, force_walk, gyro_walk = numbers[:4]
    for i in range(3):
        P[3 + i, 3 + i] += (force * h) ** 2
        P[6 + i, 6 + i] += (gyro * h) ** 2
        P[9 + i, 9 + i] += force_walk * force_walk * h
        P[12 + i, 12 + i] += gyro_walk * gyro_walk * h


@njit
def _correct(x: Any, P: Any, row: Any, innovation: Any, noise: Any) -> None:
    """Update the errors ``x`` (15,) and P by one scalar measurement.

    ``row`` (15,) is its sensitivity to the errors, ``innovation`` the measured less the predicted
    value, ``noise`` its standard deviation.
    """
    covariance, variance = np.zeros(15), noise * noise
    for i in range(15):
        for j in range(15):
            covariance[i] += P[i, j] * row[j]
    for i in range(15):
        variance += row[i] * covariance[i]
        innovation -= row[i] * x[i]
    for i in range(15):
        x[i] += covariance[i] / variance * innovation
        for j in range(15):
            P[i, j] -= covariance[i] * covariance[j] / variance


@gufunc(
    [f"void({'f8[:],' * 4}f8[:,:],{'f8[:],' * 10}f8[:,:])"],
    "(v),(v),(q),(b),(n,n),(v),(a),(v),(v),(a),(g)->(v),(v),(q),(b),(n,n)",
)
def predict_and_correct(
    p: Any, v: Any, q: Any, b: Any, P: Any, last_rate: Any, last_aid: Any,
    rate: Any, force: Any, aid: Any, numbers: Any,
    p_: Any, v_: Any, q_: Any, b_: Any, P_: Any,
) -> None:  # fmt: skip
    """Predict the estimates by the inertial sensors, then correct them by the aiding sensors."""
    altimeter, velocimeter, mu, radius, period = numbers[4:]
    h = period if last_aid[0] < np.inf else 0.0
    f, w = np.empty(3), np.empty(3)
    for i in range(3):
        f[i], w[i] = force[i] - b[i], 0.5 * (last_rate[i] + rate[i]) - b[3 + i]
    r = _matrix(_rotated(q, 0.5 * h * w[0], 0.5 * h * w[1], 0.5 * h * w[2]))
    distance = sqrt(p[0] * p[0] + p[1] * p[1] + (radius + p[2]) * (radius + p[2]))
    for i in range(3):
        up = p[i] + (radius if i == 2 else 0.0)
        force_w = r[i, 0] * f[0] + r[i, 1] * f[1] + r[i, 2] * f[2]
        v_[i] = v[i] + h * (force_w - mu * up / (distance * distance * distance))
        p_[i] = p[i] + 0.5 * h * (v[i] + v_[i])
    turned = _rotated(q, h * w[0], h * w[1], h * w[2])
    P_[:] = P
    _propagate(P_, _transition(r, f, w, h), numbers, h)

    x, row = np.zeros(15), np.zeros(15)
    r = _matrix(turned)
    if aid[0] != last_aid[0]:
        row[2] = 1.0
        _correct(x, P_, row, aid[0] - p_[2], altimeter)
        row[2] = 0.0
    if aid[1] != last_aid[1] or aid[2] != last_aid[2] or aid[3] != last_aid[3]:
        velocity_b = np.empty(3)
        for i in range(3):
            velocity_b[i] = r[0, i] * v_[0] + r[1, i] * v_[1] + r[2, i] * v_[2]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            row[:] = 0.0
            row[3], row[4], row[5] = r[0, i], r[1, i], r[2, i]
            # An attitude error theta changes R^T v by velocity_b x theta.
            row[6 + j], row[6 + k] = -velocity_b[k], velocity_b[j]
            _correct(x, P_, row, aid[1 + i] - velocity_b[i], velocimeter)

    for i in range(3):
        p_[i] += x[i]
        v_[i] += x[3 + i]
    for i in range(6):
        b_[i] = b[i] + x[9 + i]
    turned = _rotated(turned, x[6], x[7], x[8])
    length = sqrt(turned[0] ** 2 + turned[1] ** 2 + turned[2] ** 2 + turned[3] ** 2)
    for i in range(4):
        q_[i] = turned[i] / length
