"""Scalar arithmetic of the lander's variable-structure law, in the axes of paper 003."""

# mypy: disable-error-code="no-untyped-call"
from math import atan2, cos, hypot, pi, sin, sqrt, tanh
from typing import Any

from numba import njit

from mjspace.gufunc import gufunc

POLAR, SCALED, FROZEN = 0.0, 1.0, 2.0
"""Coordinates of the horizontal position; see ``lander.VariableStructure``."""


@njit
def _wrapped(angle: Any) -> Any:
    return angle - 2.0 * pi * round(angle / (2.0 * pi))


@njit
def clipped(value: Any, low: Any, high: Any) -> Any:
    """Return ``value`` within limits; NaN stays NaN."""
    if value < low:
        return low
    if value > high:
        return high
    return value


@njit
def euler(q: Any) -> Any:
    """Return psi, phi, gamma [rad] of C = Rz(gamma) Ry(phi) Rx(psi), inertial to body axes.

    ``q`` is in our axes: C^T of the paper is R(q) with the axes permuted cyclically.
    """
    q0, q1, q2, q3 = q[0], q[3], q[1], q[2]
    across, along = 2.0 * (q0 * q3 - q1 * q2), q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3
    psi = atan2(2.0 * (q0 * q1 - q2 * q3), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3)
    phi = atan2(2.0 * (q1 * q3 + q0 * q2), hypot(across, along))
    return psi, phi, atan2(across, along)


@njit
def _horizontal(p: Any, v: Any, azimuth: Any, kind: Any, re: Any) -> Any:
    """Return theta - theta_d and theta' as K expects them, r, r', and the local azimuth.

    Scaled: K is designed for r = re; a change of theta at r moves the vehicle by r/re of that at re
    (M3, erratum 16). Frozen: along the desired azimuth, since theta is singular at r = 0 (M6).
    """
    if kind == FROZEN:
        c, s = cos(azimuth), sin(azimuth)
        aside, across = c * p[1] - s * p[0], c * v[1] - s * v[0]
        return aside / re, across / re, c * p[0] + s * p[1], c * v[0] + s * v[1], azimuth
    r, theta = hypot(p[0], p[1]), atan2(p[1], p[0])
    away, turn = (p[0] * v[0] + p[1] * v[1]) / r, (p[0] * v[1] - p[1] * v[0]) / (r * r)
    share = r / re if kind == SCALED else 1.0
    return share * _wrapped(theta - azimuth), share * turn, r, away, theta


@njit
def _needed_thrust(p: Any, acceleration: Any, mu: Any, radius: Any) -> Any:
    """Return the required thrust over mass x_d'' + mu x_d / D [m/s^2], upwards."""
    x = radius + p[2]
    square = x * x + p[0] * p[0] + p[1] * p[1]
    return acceleration[2] + mu * x / (square * sqrt(square))


@gufunc(
    [f"void({'f8[:],' * 8}f8[:,:],{'f8[:],' * 8}f8[:])"],
    "(q),(v),(v),(v),(q),(v),(v),(v),(v,z),(c),(v),(v),(e),(m)->(z),(v),(v),(v)",
)
def variable_structure(
    q: Any, w: Any, p: Any, v: Any, q_d: Any, p_d: Any, v_d: Any, a_d: Any,
    K: Any, choices: Any, ka: Any, loop: Any, engine: Any, moon: Any,
    Z: Any, S: Any, commanded: Any, limited: Any,
) -> None:  # fmt: skip
    """Write Z, S, and (F, b1, b2) before and within the engine's limits."""
    kind, mixes, follows = choices
    Fe, m, re, rho, delta, least, most, reach = engine
    azimuth, _, gamma_d = euler(q_d)
    psi, phi, gamma = euler(q)
    c, s = cos(azimuth), sin(azimuth)
    turned, turning, r, away, local = _horizontal(p, v, azimuth, kind, re)
    r_d, away_d = c * p_d[0] + s * p_d[1], c * v_d[0] + s * v_d[1]

    alpha, tilt = _wrapped(psi - local), _wrapped(psi - azimuth)
    ca, sa = cos(alpha), sin(alpha)
    d_phi, d_gamma = phi - sin(tilt) * gamma_d, gamma - cos(tilt) * gamma_d
    Z[0], Z[3], Z[6] = r - r_d, away_d - away, p[2] - p_d[2]
    Z[1], Z[2] = sqrt(2.0) * turned, -turning
    Z[4], Z[5] = sa * d_phi + ca * d_gamma, sa * d_gamma - ca * d_phi

    u = (0.0, 0.0, 0.0)
    for j in range(7):
        u = (u[0] + K[0, j] * Z[j], u[1] + K[1, j] * Z[j], u[2] + K[2, j] * Z[j])
    # Rx(alpha) mixes axes whose loops have different speeds: Ka^-1 belongs inside (M5).
    k2, k3 = (ka[1], ka[2]) if mixes else (1.0, 1.0)
    u2, u3 = u[1] / k2, u[2] / k3
    climb = v[2] - v_d[2]
    S[0] = loop[0] * (ka[0] * climb + u[0])
    S[1] = loop[1] * (ka[1] * w[0] + k2 * (ca * u2 + sa * u3))
    S[2] = loop[2] * (ka[2] * w[1] + k3 * (ca * u3 - sa * u2))

    for i in range(3):
        commanded[i] = -S[i] - rho * tanh(rho * S[i] / delta)
    if follows:
        upright = max(0.5, cos(phi) * cos(gamma))
        commanded[0] = m * (_needed_thrust(p_d, a_d, moon[0], moon[1]) + commanded[0]) / upright
    else:
        commanded[0] += Fe
    limited[0] = clipped(commanded[0], least, most)
    limited[1] = clipped(commanded[1], -reach, reach)
    limited[2] = clipped(commanded[2], -reach, reach)
