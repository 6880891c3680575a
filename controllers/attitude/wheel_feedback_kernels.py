"""The arithmetic of the lecture's wheel laws: one generalized ufunc for each, over any vehicles.

Sums are plain loops that no compiler reorders: a vehicle's numbers are bit for bit the same alone
and in a batch. Numba's cache does not notice changes in other files, so that all compiled functions
are in this one.
"""

# mypy: disable-error-code="no-untyped-call, call-arg"
import math
from typing import Any

from numba import guvectorize, njit


@njit
def _cross(a: Any, b: Any) -> Any:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit
def _times(M: Any, i: int, v: Any) -> float:
    return float(M[i, 0] * v[0] + M[i, 1] * v[1] + M[i, 2] * v[2])


@njit
def _error(q: Any, qd: Any) -> Any:
    """Return the quaternion conj(qd) q: desired axes to body."""
    return (
        qd[0] * q[0] + qd[1] * q[1] + qd[2] * q[2] + qd[3] * q[3],
        qd[0] * q[1] - qd[1] * q[0] - qd[2] * q[3] + qd[3] * q[2],
        qd[0] * q[2] + qd[1] * q[3] - qd[2] * q[0] - qd[3] * q[1],
        qd[0] * q[3] - qd[1] * q[2] + qd[2] * q[1] - qd[3] * q[0],
    )


@njit
def _wheel_momentum(w: Any, speed: Any, axes: Any, Jw: Any) -> Any:
    """Return the wheels' absolute momentum h = sum a Jw (a.w + Omega)."""
    x, y, z = 0.0, 0.0, 0.0
    for n in range(Jw.size):
        spin = Jw[n] * (axes[n, 0] * w[0] + axes[n, 1] * w[1] + axes[n, 2] * w[2] + speed[n])
        x += axes[n, 0] * spin
        y += axes[n, 1] * spin
        z += axes[n, 2] * spin
    return x, y, z


@njit
def _reaction(u: Any, h: Any, turning: Any, torque: Any) -> None:
    """Write the torque of the wheels' motors on the bus, -h' = u - h x turning."""
    gyro = _cross(h, turning)
    for i in range(3):
        torque[i] = u[i] - gyro[i]


@guvectorize(
    [f"void({'f8[:],' * 6}f8[:,:],f8[:,:],f8[:,:],f8[:],f8,{'f8[:],' * 4}f8[:])"],
    "(q),(v),(q),(v),(v),(n),(v,x),(v,v),(n,v),(n),()->(v),(v),(v),(v),(v)",
    cache=True,
)
def linear(
    q: Any, w: Any, qd: Any, wd: Any, ad: Any, speed: Any,
    K: Any, M: Any, axes: Any, Jw: Any, full_rate: float,
    torque: Any, a: Any, delta: Any, u: Any, h: Any,
) -> None:  # fmt: skip
    """u = u_ref + K [delta, a]; ``full_rate`` is 1.0, or 0.0 for h x delta (erratum 1)."""
    error = _error(q, qd)
    momentum = (_times(M, 0, wd), _times(M, 1, wd), _times(M, 2, wd))
    gyro = _cross(wd, momentum)
    for i in range(3):
        a[i] = 2.0 * error[1 + i] / error[0]
        delta[i] = w[i] - wd[i]
    for i in range(3):
        u[i] = _times(M, i, ad) + gyro[i]
        for j in range(3):
            u[i] += K[i, j] * delta[j] + K[i, 3 + j] * a[j]
    h[0], h[1], h[2] = _wheel_momentum(w, speed, axes, Jw)
    _reaction(u, h, w if full_rate != 0.0 else delta, torque)


@guvectorize(
    [f"void({'f8[:],' * 8}f8[:,:],f8[:],f8[:],{'f8[:],' * 7}f8[:])"],
    "(q),(v),(q),(n),(q),(s),(s),(s),(n,v),(n),(c)->(v),(q),(s),(v),(q),(s),(s),(s)",
    cache=True,
)
def quaternion(
    q_in: Any, w: Any, qd: Any, speed: Any,
    before: Any, sign: Any, path: Any, impulse: Any, axes: Any, Jw: Any, gains: Any,
    torque: Any, error: Any, stiffness: Any, u: Any,
    q: Any, sign_out: Any, path_out: Any, impulse_out: Any,
) -> None:  # fmt: skip
    """u = -(k s q_e + c w), gains [k, c, hysteresis, period]; s = +-1 switches with hysteresis."""
    k, c, hysteresis, period = gains
    along = q_in[0] * before[0] + q_in[1] * before[1] + q_in[2] * before[2] + q_in[3] * before[3]
    for i in range(4):
        q[i] = -q_in[i] if along < 0.0 else q_in[i]
    found = _error(q, qd)
    for i in range(4):
        error[i] = found[i]
    sign_out[0] = -sign[0] if sign[0] * error[0] < -hysteresis else sign[0]
    stiffness[0] = k * sign_out[0]
    for i in range(3):
        u[i] = -(stiffness[0] * error[1 + i] + c * w[i])
    path_out[0] = path[0] + period * math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    impulse_out[0] = impulse[0] + period * math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    _reaction(u, _wheel_momentum(w, speed, axes, Jw), w, torque)
