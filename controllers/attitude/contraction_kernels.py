"""The arithmetic of the contraction laws: one generalized ufunc for each, over any vehicles.

Plain loops without fused or reordered sums: a vehicle's numbers are bit for bit the same alone and
in a batch. Numba's cache does not notice changes in other files, so that all compiled functions are
in this one.
"""

# mypy: disable-error-code="no-untyped-call, call-arg"
from typing import Any

import numpy as np
from numba import guvectorize, njit


@njit
def _product(p: Any, q: Any) -> Any:
    """Return the quaternion product p q."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@njit
def _along(q: Any, u: Any) -> Any:
    """Return J(q)^T u, the vector part of conj(q) u."""
    return _product((q[0], -q[1], -q[2], -q[3]), u)[1:]


@njit
def _cross(a: Any, b: Any) -> Any:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit
def _signed(q: Any, before: Any, out: Any) -> None:
    """Write q or -q, whichever is nearer to ``before``: a sensor may report either sign."""
    along = q[0] * before[0] + q[1] * before[1] + q[2] * before[2] + q[3] * before[3]
    sign = -1.0 if along < 0.0 else 1.0
    for i in range(4):
        out[i] = sign * q[i]


@njit
def _desired_rate(q: Any, w: Any, qd: Any, wr: Any, ar: Any, lc: float) -> Any:
    """Return wd, (3.8), and its derivative, (3.9)-(3.10), of paper 002.

    With u = qd' + lc qd they are 2 J(q)^T u and 2 J(q)^T u' - J(u)^T J(q) w, where
    J(q) w = q [0, w], qd' = qd [0, wr] / 2 and wr' = ar.
    """
    spin = (0.0, wr[0], wr[1], wr[2])
    a, b = _product(qd, spin), _product(qd, (0.0, ar[0], ar[1], ar[2]))
    c = _product(a, spin)
    u = (
        0.5 * a[0] + lc * qd[0],
        0.5 * a[1] + lc * qd[1],
        0.5 * a[2] + lc * qd[2],
        0.5 * a[3] + lc * qd[3],
    )
    du = (
        0.5 * (b[0] + 0.5 * c[0] + lc * a[0]),
        0.5 * (b[1] + 0.5 * c[1] + lc * a[1]),
        0.5 * (b[2] + 0.5 * c[2] + lc * a[2]),
        0.5 * (b[3] + 0.5 * c[3] + lc * a[3]),
    )
    f, g, h = _along(q, u), _along(q, du), _along(u, _product(q, (0.0, w[0], w[1], w[2])))
    return (
        (2.0 * f[0], 2.0 * f[1], 2.0 * f[2]),
        (2.0 * g[0] - h[0], 2.0 * g[1] - h[1], 2.0 * g[2] - h[2]),
    )


@njit
def _limited(torque: float, limit: float) -> float:
    """Return the torque within +-limit; NaN stays NaN."""
    if torque > limit:
        return limit
    if torque < -limit:
        return -limit
    return torque


@njit
def _momentum_block(wd: Any, q: Any, out: Any) -> None:
    """Write S(wd) R(q)^T, (3, 3): the columns of R^T are the inertial axes in body axes."""
    conjugate = (q[0], -q[1], -q[2], -q[3])
    for j in range(3):
        axis = (0.0, 1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2))
        column = _cross(wd, _product(_product(conjugate, axis), q)[1:])
        for i in range(3):
            out[i, j] = column[i]


@njit
def _regressor(a: Any, block: Any) -> Any:
    """Return [W6(a), block], (3, 9), with W6(a) m = M a."""
    y = np.zeros((3, 9))
    y[0, 0], y[0, 1], y[0, 2] = a[0], a[1], a[2]
    y[1, 1], y[1, 3], y[1, 4] = a[0], a[1], a[2]
    y[2, 2], y[2, 4], y[2, 5] = a[0], a[1], a[2]
    for i in range(3):
        for j in range(3):
            y[i, 6 + j] = block[i, j]
    return y


@njit
def _feedback(y: Any, theta: Any, w: Any, wd: Any, kc: float, limit: float, e: Any, t: Any) -> None:
    """Write e = w - wd and the torque Y theta - Kc e, (4.2), within its limit."""
    for i in range(3):
        e[i] = w[i] - wd[i]
        total = -kc * e[i]
        for j in range(9):
            total += y[i, j] * theta[j]
        t[i] = _limited(total, limit)


_MOTION = "(q),(v),(q),(v),(v),(q)"  # attitude, rate, three fields of the reference, last attitude


@guvectorize(
    [f"void({'f8[:],' * 6}f8[:],f8[:,:],f8[:,:],f8[:],f8[:],f8[:],f8[:],f8[:],f8[:])"],
    f"{_MOTION},(n),(v,v),(n,v),(n),(c)->(v),(v),(v),(q)",
    cache=True,
)
def ideal(
    q_in: Any, w: Any, qd: Any, wr: Any, ar: Any, before: Any,
    wheel_speed: Any, M: Any, axes: Any, Jw: Any, gains: Any,
    torque: Any, e: Any, wd_out: Any, q: Any,
) -> None:  # fmt: skip
    """Paper 002, (3.6), gains [lc, Kc, limit]; momentum from the tachometers."""
    lc, kc, limit = gains
    _signed(q_in, before, q)
    wd, dwd = _desired_rate(q, w, qd, wr, ar, lc)
    px, py, pz = 0.0, 0.0, 0.0
    for n in range(Jw.size):
        h = Jw[n] * (axes[n, 0] * w[0] + axes[n, 1] * w[1] + axes[n, 2] * w[2] + wheel_speed[n])
        px += axes[n, 0] * h
        py += axes[n, 1] * h
        pz += axes[n, 2] * h
    px += M[0, 0] * w[0] + M[0, 1] * w[1] + M[0, 2] * w[2]
    py += M[1, 0] * w[0] + M[1, 1] * w[1] + M[1, 2] * w[2]
    pz += M[2, 0] * w[0] + M[2, 1] * w[1] + M[2, 2] * w[2]
    gyro = _cross((px, py, pz), wd)
    for i in range(3):
        wd_out[i] = wd[i]
        e[i] = w[i] - wd[i]
        inertial = M[i, 0] * dwd[0] + M[i, 1] * dwd[1] + M[i, 2] * dwd[2]
        torque[i] = _limited(inertial - gyro[i] - kc * e[i], limit)


@guvectorize(
    [f"void({'f8[:],' * 6}f8[:],f8[:],f8[:],f8[:],f8[:],f8[:],f8[:])"],
    f"{_MOTION},(p),(c)->(v),(v),(v),(q),(p)",
    cache=True,
)
def gradient(
    q_in: Any, w: Any, qd: Any, wr: Any, ar: Any, before: Any, theta: Any, gains: Any,
    torque: Any, e: Any, wd_out: Any, q: Any, theta_out: Any,
) -> None:  # fmt: skip
    """Paper 002, (4.2) and (4.21), gains [lc, Kc, limit, ga, period]."""
    lc, kc, limit, ga, period = gains
    _signed(q_in, before, q)
    wd, dwd = _desired_rate(q, w, qd, wr, ar, lc)
    block = np.empty((3, 3))
    _momentum_block(wd, q, block)
    y = _regressor(dwd, block)
    _feedback(y, theta, w, wd, kc, limit, e, torque)
    for i in range(3):
        wd_out[i] = wd[i]
    for j in range(9):
        descent = y[0, j] * e[0] + y[1, j] * e[1] + y[2, j] * e[2]
        theta_out[j] = theta[j] - period * ga * descent


@guvectorize(
    [f"void({'f8[:],' * 8}f8[:,:],f8[:],f8[:,:],{'f8[:],' * 9}f8[:,:],f8[:],f8[:,:],f8[:])"],
    f"{_MOTION},(p),(p),(p,p),(v),(v,v),(v),(c)->(v),(v),(v),(v),(q),(p),(p),(p,p),(v),(v,v),(v)",
    cache=True,
)
def adaptive(
    q_in: Any, w: Any, qd: Any, wr: Any, ar: Any, before: Any,
    theta: Any, g: Any, Z: Any, wf: Any, Pf: Any, tf: Any, gains: Any,
    torque: Any, e: Any, wd_out: Any, eps: Any, q: Any,
    theta_out: Any, g_out: Any, Z_out: Any, wf_out: Any, Pf_out: Any, tf_out: Any,
) -> None:  # fmt: skip
    """Paper 002, (4.2), (4.5)-(4.9), gains [lc, Kc, limit, ga, period, lF, da, lf].

    The bracket of (4.6), with erratum 15, is written as -lf g + ga Yf^T eps + Z theta_hat'.
    """
    lc, kc, limit, ga, period, lF, da, lf = gains
    _signed(q_in, before, q)
    wd, dwd = _desired_rate(q, w, qd, wr, ar, lc)
    block = np.empty((3, 3))
    _momentum_block(wd, q, block)
    y = _regressor(dwd, block)
    _feedback(y, theta, w, wd, kc, limit, e, torque)

    yf = _regressor((lF * (w[0] - wf[0]), lF * (w[1] - wf[1]), lF * (w[2] - wf[2])), Pf)
    for i in range(3):
        wd_out[i] = wd[i]
        predicted = 0.0
        for j in range(9):
            predicted += yf[i, j] * theta[j]
        eps[i] = predicted - tf[i]

    change = np.empty(9)
    for j in range(9):
        descent = y[0, j] * e[0] + y[1, j] * e[1] + y[2, j] * e[2]
        change[j] = -ga * (da * g[j] + descent)
        theta_out[j] = theta[j] + period * change[j]
    for i in range(9):
        carried = 0.0
        for j in range(9):
            carried += Z[i, j] * change[j]
            information = yf[0, i] * yf[0, j] + yf[1, i] * yf[1, j] + yf[2, i] * yf[2, j]
            Z_out[i, j] = Z[i, j] + period * (ga * information - lf * Z[i, j])
        correction = yf[0, i] * eps[0] + yf[1, i] * eps[1] + yf[2, i] * eps[2]
        g_out[i] = g[i] + period * (ga * correction - lf * g[i] + carried)

    _momentum_block(w, q, block)
    for i in range(3):
        wf_out[i] = wf[i] + period * lF * (w[i] - wf[i])
        tf_out[i] = tf[i] + period * lF * (torque[i] - tf[i])
        for j in range(3):
            Pf_out[i, j] = Pf[i, j] + period * lF * (block[i, j] - Pf[i, j])
