"""Steering of single-gimbal CMGs: a torque on the bus to gimbal rates, through singularities.

CMG i turns by d about the axis g_i of the bus and spins about s_i = s0_i cos d + (g_i x s0_i) sin d
with the momentum h_i = Jw W. The torque on the bus is -h0 A d', where the columns of A are
(h_i / h0) g_i x s_i and h0 is a scale. All arrays may have leading vehicle axes.

Lambda: Y. Nakamura, H. Hanafusa, "Inverse kinematic solutions with singularity robustness", 1986.
E: B. Wie, D. Bailey, C. Heiberg, "Singularity robust steering logic for redundant single-gimbal
control moment gyros", 2001; without E the gimbals lock when the torque is along the singular
direction.
"""

# mypy: disable-error-code="no-untyped-call, call-arg"
import math
from typing import Any, NamedTuple

from numba import njit

from mjspace.contract import Array
from mjspace.gufunc import gufunc

_DITHER_RATE = 0.5 * math.pi  # rad/s, Wie et al.


class Cluster(NamedTuple):
    """CMGs that are fixed to a bus."""

    gimbal_axes: Array
    """g: unit vectors, body axes, (n, 3)."""
    spin_axes: Array
    """s0: unit vectors, body axes, at gimbal angles of zero, (n, 3)."""
    wheel_inertia: Array
    """Jw: axial inertia of each wheel [kg m^2], (n,)."""


def momentum(cluster: Cluster, gimbal_angle: Array, wheel_speed: Array) -> Array:
    """Return the wheels' momentum relative to the bus, body axes [N m s], (..., 3).

    ``gimbal_angle`` [rad] and ``wheel_speed`` [rad/s] are (..., n).
    """
    h: Array = _momentum.ufunc(*cluster, gimbal_angle, wheel_speed)
    return h


def steer(
    cluster: Cluster,
    torque: Array,
    gimbal_angle: Array,
    wheel_speed: Array,
    time: Array,
    gains: Array,
) -> tuple[Array, Array, Array]:
    """Return gimbal rates (..., n) [rad/s], the measure and lambda, both (..., 1).

    ``torque`` (..., 3) [N m] is the commanded torque on the bus, body axes; ``time`` (1,) [s];
    ``gains`` is [h0 (N m s), m0, lambda0, e0, null gain (1/s)].

    d' = -A^T (A A^T + lambda E)^-1 torque / h0, plus null motion. The singularity measure is
    m = sqrt(det(A A^T)). lambda = lambda0 (1 - m/m0)^2 below m0 and zero above, where the torque is
    exact. E is symmetric, with ones on its diagonal and e0 sin(pi t/2 + phase) off it. Null motion
    gives no torque; it is along the gradient of m^2, times m^2 so that it is regular everywhere.
    """
    rate, measure, damping = _steer.ufunc(torque, gimbal_angle, wheel_speed, *cluster, time, gains)
    return rate, measure, damping


@njit
def spin_axis(g: Any, s: Any, angle: float) -> Any:
    """Return the spin axis at a gimbal ``angle`` [rad] and its derivative by the angle."""
    c, d = math.cos(angle), math.sin(angle)
    x, y, z = g[1] * s[2] - g[2] * s[1], g[2] * s[0] - g[0] * s[2], g[0] * s[1] - g[1] * s[0]
    return (
        (c * s[0] + d * x, c * s[1] + d * y, c * s[2] + d * z),
        (c * x - d * s[0], c * y - d * s[1], c * z - d * s[2]),
    )


@njit
def _adjugate(xx: float, yy: float, zz: float, yz: float, xz: float, xy: float) -> Any:
    """Return the adjugate of a symmetric matrix, its entries in the same order, and the
    determinant."""
    a, b, c = yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy
    d, e, f = xz * xy - xx * yz, yz * xy - yy * xz, yz * xz - zz * xy
    return (a, b, c, d, e, f), xx * a + xy * f + xz * e


@njit
def _product(M: Any, v: Any) -> Any:
    xx, yy, zz, yz, xz, xy = M
    return (
        xx * v[0] + xy * v[1] + xz * v[2],
        xy * v[0] + yy * v[1] + yz * v[2],
        xz * v[0] + yz * v[1] + zz * v[2],
    )


@njit
def _dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@gufunc(["void(f8[:,:],f8[:,:],f8[:],f8[:],f8[:],f8[:])"], "(n,v),(n,v),(n),(n),(n)->(v)")
def _momentum(g: Any, s0: Any, Jw: Any, angle: Any, speed: Any, h: Any) -> None:
    h[:] = 0.0
    for i in range(angle.size):
        s, _ = spin_axis(g[i], s0[i], angle[i])
        for k in range(3):
            h[k] += Jw[i] * speed[i] * s[k]


@gufunc(
    ["void(f8[:],f8[:],f8[:],f8[:,:],f8[:,:],f8[:],f8[:],f8[:],f8[:],f8[:],f8[:])"],
    "(v),(n),(n),(n,v),(n,v),(n),(o),(k)->(n),(o),(o)",
)
def _steer(
    torque: Any, angle: Any, speed: Any, g: Any, s0: Any, Jw: Any, time: Any, gains: Any,
    rate: Any, measure: Any, damping: Any,
) -> None:  # fmt: skip
    h0, m0, lambda0, e0, null_gain = gains
    xx, yy, zz, yz, xz, xy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(angle.size):
        _, t = spin_axis(g[i], s0[i], angle[i])
        share = Jw[i] * speed[i] / h0
        x, y, z = share * t[0], share * t[1], share * t[2]
        xx, yy, zz = xx + x * x, yy + y * y, zz + z * z
        yz, xz, xy = yz + y * z, xz + x * z, xy + x * y
    adjugate, determinant = _adjugate(xx, yy, zz, yz, xz, xy)
    m = math.sqrt(max(determinant, 0.0))  # rounding may make it negative near zero
    lack = max(1.0 - m / m0, 0.0)
    lam = lambda0 * lack * lack
    phase = _DITHER_RATE * time[0]
    robust, scale = _adjugate(
        xx + lam,
        yy + lam,
        zz + lam,
        yz + lam * e0 * math.sin(phase),
        xz + lam * e0 * math.cos(phase),
        xy - lam * e0 * math.sin(phase),
    )
    # With lambda0 = 0 the inverse does not exist in a singularity: the rates are then infinite.
    per_torque = -1.0 / (scale * h0) if scale != 0.0 else -math.inf
    x, y, z = _product(robust, torque)
    direction = (x * per_torque, y * per_torque, z * per_torque)
    measure[0], damping[0] = m, lam
    x, y, z = 0.0, 0.0, 0.0
    for i in range(angle.size):
        s, t = spin_axis(g[i], s0[i], angle[i])
        share = Jw[i] * speed[i] / h0
        rate[i] = share * _dot(t, direction)
        # The gradient of m^2 is 2 a'.adj(A A^T) a, with a' = -share s.
        ascent = -2.0 * share * share * _dot(s, _product(adjugate, t))
        rate[i] += null_gain * determinant * ascent
        x, y, z = x + share * t[0] * ascent, y + share * t[1] * ascent, z + share * t[2] * ascent
    # Remove the part of the gradient that gives a torque.
    removed = _product(adjugate, (x, y, z))
    for i in range(angle.size):
        _, t = spin_axis(g[i], s0[i], angle[i])
        rate[i] -= null_gain * Jw[i] * speed[i] / h0 * _dot(t, removed)
