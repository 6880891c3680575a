"""The arithmetic of the PD+ laws: one generalized ufunc for each, over any vehicles.

Sums are plain loops that no compiler reorders: a vehicle's numbers are bit for bit the same alone
and in a batch. Numba's cache does not notice changes in other files, so that all compiled functions
are in this one.
"""

# mypy: disable-error-code="no-untyped-call, call-arg"
import math
from typing import Any

import numpy as np
from numba import guvectorize, njit


@njit
def _dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit
def _cross(a: Any, b: Any) -> Any:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit
def _times(M: Any, v: Any) -> Any:
    return _dot(M[0], v), _dot(M[1], v), _dot(M[2], v)


@njit
def _error(q: Any, qd: Any) -> Any:
    """Return the error quaternion conj(qd) q, desired axes to body, with the sign of least angle.

    At 180 deg its scalar is zero and both signs are valid: the sign is then chosen by the vector,
    so that q and -q give the same result.
    """
    w = qd[0] * q[0] + qd[1] * q[1] + qd[2] * q[2] + qd[3] * q[3]
    x = qd[0] * q[1] - qd[1] * q[0] - qd[2] * q[3] + qd[3] * q[2]
    y = qd[0] * q[2] + qd[1] * q[3] - qd[2] * q[0] - qd[3] * q[1]
    z = qd[0] * q[3] - qd[1] * q[2] + qd[2] * q[1] - qd[3] * q[0]
    first = w if w != 0.0 else x if x != 0.0 else y if y != 0.0 else z
    sign = -1.0 if first < 0.0 else 1.0
    return sign * w, (sign * x, sign * y, sign * z)


@njit
def _to_body_axes(scalar: Any, vector: Any, v: Any) -> Any:
    """Return R_e^T v: components in body axes of ``v`` in desired axes."""
    a = _cross(vector, v)
    b = _cross(vector, a)
    return (
        v[0] + 2.0 * (b[0] - scalar * a[0]),
        v[1] + 2.0 * (b[1] - scalar * a[1]),
        v[2] + 2.0 * (b[2] - scalar * a[2]),
    )


@njit
def _tracking(q: Any, w: Any, qd: Any, wd: Any, ad: Any) -> Any:
    """Return sigma_e, the desired rate and acceleration in body axes, and w_e."""
    scalar, vector = _error(q, qd)
    sigma = (vector[0] / (1.0 + scalar), vector[1] / (1.0 + scalar), vector[2] / (1.0 + scalar))
    wb, ab = _to_body_axes(scalar, vector, wd), _to_body_axes(scalar, vector, ad)
    return sigma, wb, ab, (w[0] - wb[0], w[1] - wb[1], w[2] - wb[2])


@guvectorize(
    [f"void({'f8[:],' * 5}f8[:,:],{'f8[:],' * 5}f8[:])"],
    "(q),(v),(q),(v),(v),(v,v),(c)->(v),(v),(v),(v),(v)",
    cache=True,
)
def classical(
    q: Any, w: Any, qd: Any, wd: Any, ad: Any, M: Any, gains: Any,
    torque: Any, sigma_e: Any, w_e: Any, feedforward: Any, feedback: Any,
) -> None:  # fmt: skip
    """Servín Aguilar 2022, footnote to figure 3.1; gains [kp, kv]."""
    kp, kv = gains
    sigma, wb, ab, we = _tracking(q, w, qd, wd, ad)
    inertial, gyro = _times(M, ab), _cross(wb, _times(M, wb))
    for i in range(3):
        sigma_e[i], w_e[i] = sigma[i], we[i]
        feedforward[i] = inertial[i] + gyro[i]
        feedback[i] = -kp * sigma[i] - kv * we[i]
        torque[i] = feedforward[i] + feedback[i]


@guvectorize(
    [f"void({'f8[:],' * 6}f8[:,:],{'f8[:],' * 6}f8[:])"],
    "(q),(v),(v),(q),(v),(v),(v,v),(c)->(v),(v),(v),(v),(v),(v)",
    cache=True,
)
def modified(
    q: Any, w: Any, momentum: Any, qd: Any, wd: Any, ad: Any, M: Any, gains: Any,
    torque: Any, sigma_e: Any, s: Any, feedforward: Any, feedback: Any, compensation: Any,
) -> None:  # fmt: skip
    """Servín Aguilar 2022, (3.7)-(3.9) with (3.19); gains [lam, Kc, tbar, eps], eps above zero."""
    lam, kc, bound, smoothing = gains
    sigma, wb, ab, we = _tracking(q, w, qd, wd, ad)
    square, along = _dot(sigma, sigma), _dot(sigma, we)
    turning, twist = _cross(wb, we), _cross(sigma, we)
    wr, dwr = np.empty(3), np.empty(3)
    for i in range(3):
        sigma_e[i] = sigma[i]
        s[i] = we[i] + 2.0 * lam * sigma[i]
        wr[i] = wb[i] - 2.0 * lam * sigma[i]
        spread = 0.5 * (1.0 - square) * we[i] + twist[i] + along * sigma[i]  # G(sigma_e) w_e
        dwr[i] = ab[i] + turning[i] - lam * spread
    inertial, gyro = _times(M, dwr), _cross(momentum, wr)
    share = -bound * bound / (bound * math.sqrt(_dot(s, s)) + smoothing)
    for i in range(3):
        feedforward[i] = inertial[i] - gyro[i]
        feedback[i] = -0.5 * (1.0 + square) * sigma[i] - kc * s[i]
        compensation[i] = share * s[i]
        torque[i] = feedforward[i] + feedback[i] + compensation[i]


# Not NumPy's matrix product: BLAS may round differently in a batch than alone.
@guvectorize(["void(f8[:,:],f8[:],f8[:])"], "(v,v),(v)->(v)", cache=True)
def rigid_momentum(M: Any, w: Any, momentum: Any) -> None:
    """Write M w [N m s]."""
    for i in range(3):
        momentum[i] = _dot(M[i], w)


@guvectorize(
    ["void(f8[:,:],f8[:],f8[:,:],f8[:],f8[:],f8[:])"],
    "(v,v),(v),(n,v),(n),(n)->(v)",
    cache=True,
)
def gyrostat_momentum(
    M: Any, w: Any, axes: Any, wheel_inertia: Any, wheel_speed: Any, momentum: Any
) -> None:
    """Write M w plus the momentum of the wheels [N m s]; M is without their axial inertia."""
    for i in range(3):
        momentum[i] = _dot(M[i], w)
    for n in range(wheel_speed.size):
        spin = wheel_inertia[n] * (wheel_speed[n] + _dot(axes[n], w))
        for i in range(3):
            momentum[i] += spin * axes[n, i]
