"""Steering of a double-gimbal variable-speed control moment gyro (DGVSCMG): torque to gimbal rates.

The outer gimbal turns by do about +z of the bus, the inner one by di about +y of the outer. The
wheel spins at W about s, +x of the inner gimbal. All axes meet in one point. In bus axes, with
t = s x gi:

    s = (co ci, so ci, -si)   gi = (-so, co, 0)   t = (co si, so si, ci)   go = (0, 0, 1)

(s, gi, t) is a rotation matrix (E3: the printed second column is not a unit vector). The torque on
the bus is -chi eta with eta = (do', di', W'). chi is singular at di = +-90 deg, where the outer
gimbal's axis is along the spin axis. J. Servín Aguilar, "Control de
orientación para satélites con compensación de vibración", UNAM 2022 (paper 001), section 5.1. All
arrays may have leading vehicle axes.
"""

# mypy: disable-error-code="no-untyped-call, call-arg"
import math
from typing import Any

import numpy as np
from numba import njit

from mjspace.contract import Array
from mjspace.gufunc import gufunc


def torque_matrix(gimbal_angle: Array, wheel_speed: Array, wheel_inertia: float) -> Array:
    """Return chi (..., 3, 3) of (2.55): the torque on the bus [N m], body axes, is -chi eta (E18).

    ``gimbal_angle`` (..., 2): do, di [rad]; ``wheel_speed`` (..., 1): W, relative to the inner
    gimbal [rad/s]; ``wheel_inertia``: Jw [kg m^2], about the spin axis. Its columns are for do' and
    di' [N m s] and for W' [kg m^2].
    """
    (so, si), (co, ci) = (np.moveaxis(part(gimbal_angle), -1, 0) for part in (np.sin, np.cos))
    s = np.stack([co * ci, so * ci, -si], axis=-1)
    ci_gi = np.stack([-so * ci, co * ci, np.zeros_like(so)], axis=-1)
    t = np.stack([co * si, so * si, ci], axis=-1)
    momentum = wheel_inertia * wheel_speed
    return np.stack([momentum * ci_gi, -momentum * t, wheel_inertia * s], axis=-1)


def steer(
    torque: Array,
    gimbal_angle: Array,
    wheel_speed: Array,
    wheel_inertia: float,
    damping: float = 0.01,
    momentum_damping: float = 0.0,
) -> tuple[Array, Array]:
    """Return eta = -chi^-1 torque (..., 3), as do', di' [rad/s], W' [rad/s^2], and the authority.

    ``torque`` (..., 3) [N m] is the commanded torque on the bus, body axes; the others are as in
    ``torque_matrix``. The printed gamma (E17) is replaced: 1/cos(di) of (5.8) is damped to
    cos(di) / (cos(di)^2 + damping^2), which is regular at every di, keeps its sign, and is at most
    1/(2 damping). The default reduces do' by 25 % at 1 deg from the singularity, by 0.3 % at
    10 deg. 1/(Jw W) is damped alike, by ``momentum_damping`` [N m s]; without it the rates are
    infinite or NaN at W = 0.

    The authority (..., 1) is the distance from the singularity, Jw |W cos(di)| [N m s]: the torque
    about gi per rad/s of the outer gimbal.
    """
    eta, authority = _steer.ufunc(
        torque, gimbal_angle, wheel_speed, wheel_inertia, damping, momentum_damping
    )
    return eta, authority


def steer_as_printed(
    torque: Array,
    gimbal_angle: Array,
    wheel_speed: Array,
    wheel_inertia: float,
    gamma_0: float = 0.01,
    zeta: float = 10.0,
) -> tuple[Array, Array]:
    """Return eta and the authority as ``steer``, by (5.8) as printed, which cannot be flown (E17).

    (5.8) has 1/(cos(di) + gamma), gamma = gamma_0 exp(zeta cos(di)^2) sin(di). The sign of zeta is
    wrong: at 5 deg gamma is 17.8, which leaves 5 % of do'. The denominator is zero at -0.26 and at
    -47.8 deg, and the command is reversed in between. With ``zeta`` = -10, as the text intends, it
    is zero at -89.43 and 90.57 deg.
    """
    eta, authority = _steer_as_printed.ufunc(
        torque, gimbal_angle, wheel_speed, wheel_inertia, gamma_0, zeta
    )
    return eta, authority


def within(eta: Array, limits: Array) -> Array:
    """Return ``eta`` (..., 3) with each component within its limit of ``limits`` (3,).

    Both gimbal rates are scaled together, so that the torque perpendicular to the spin axis keeps
    its direction. The wheel's acceleration is limited independently: otherwise a wheel at a low
    speed could not be accelerated.
    """
    excess = np.abs(eta) / limits
    gimbals = np.max(excess[..., :2], axis=-1, keepdims=True)
    excess = np.concatenate([gimbals, gimbals, excess[..., 2:]], axis=-1)
    kept: Array = eta / np.maximum(excess, 1.0)
    return kept


def momentum(
    inertia: Array, rate: Array, gimbal_angle: Array, wheel_speed: Array, wheel_inertia: float
) -> Array:
    """Return h = Mb w + Jw W s [N m s], body axes, (..., 3), of the bus (3, 3) and the wheel."""
    h: Array = _momentum.ufunc(inertia, rate, gimbal_angle, wheel_speed, wheel_inertia)
    return h


def carried(rate: Array, gimbal_angle: Array, gimbal_rate: Array) -> Array:
    """Return the rate of each hinge's carrier about the hinge axis [rad/s], (..., 3).

    It is zero for the gimbals, and s . w - do' sin(di) for the wheel, with the bus's ``rate``
    (..., 3). A motor torque u on the wheel gives exactly Jw (W + carried)' = u; the thesis has
    Jw W' = u.
    """
    rates: Array = _carried.ufunc(rate, gimbal_angle, gimbal_rate)
    return rates


def gimbal_load(
    rate: Array, gimbal_angle: Array, eta: Array, wheel_speed: Array, wheel_inertia: float
) -> Array:
    """Return the load torques on the motors of outer and inner gimbal (..., 2) [N m].

    The wheel needs the torque (w + do' go + di' gi) x Jw W s + Jw W' s; its components along go and
    gi act on the gimbals' motors, which in a double gimbal carry the whole output torque. The
    thesis' speed loops neglect it (E20) and diverge. ``rate`` (..., 3) [rad/s] is the bus's, body
    axes; ``eta`` (..., 3) is do', di' [rad/s], W' [rad/s^2], commanded or measured; the others are
    as in ``torque_matrix``. Exact for a wheel of three equal inertias.
    """
    load: Array = _gimbal_load.ufunc(rate, gimbal_angle, eta, wheel_speed, wheel_inertia)
    return load


@njit
def _axes(angle: Any) -> Any:
    """Return s, gi, t in bus axes."""
    so, co, si, ci = math.sin(angle[0]), math.cos(angle[0]), math.sin(angle[1]), math.cos(angle[1])
    return (co * ci, so * ci, -si), (-so, co, 0.0), (co * si, so * si, ci)


@njit
def _dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(error_model="numpy")
def _rates(torque: Any, angle: Any, per_h: float, Jw: float, inverse: float, eta: Any) -> None:
    """Write -chi^-1 torque, with ``inverse`` for 1/cos(di), ``per_h`` for 1/(Jw W)."""
    s, gi, t = _axes(angle)
    eta[0] = -_dot(gi, torque) * inverse * per_h
    eta[1] = _dot(t, torque) * per_h
    eta[2] = -_dot(s, torque) / Jw


_INPUTS = "(v),(g),(n),()"  # torque or rate, gimbal angles, wheel speed, wheel inertia


@gufunc(["void(f8[:],f8[:],f8[:],f8,f8,f8,f8[:],f8[:])"], f"{_INPUTS},(),()->(v),(n)")
def _steer(
    torque: Any, angle: Any, speed: Any, Jw: Any, damping: Any, h0: Any, eta: Any, authority: Any
) -> None:
    cosine, h = math.cos(angle[1]), Jw * speed[0]
    inverse = cosine / (cosine * cosine + damping * damping)
    _rates(torque, angle, h / (h * h + h0 * h0), Jw, inverse, eta)
    authority[0] = abs(h * cosine)


@gufunc(["void(f8[:],f8[:],f8[:],f8,f8,f8,f8[:],f8[:])"], f"{_INPUTS},(),()->(v),(n)")
def _steer_as_printed(
    torque: Any, angle: Any, speed: Any, Jw: Any, gamma_0: Any, zeta: Any, eta: Any, authority: Any
) -> None:
    cosine = math.cos(angle[1])
    gamma = gamma_0 * math.exp(zeta * cosine * cosine) * math.sin(angle[1])
    _rates(torque, angle, 1.0 / (Jw * speed[0]), Jw, 1.0 / (cosine + gamma), eta)
    authority[0] = abs(Jw * speed[0] * cosine)


@gufunc(["void(f8[:],f8[:],f8[:],f8[:],f8,f8[:])"], "(v),(g),(v),(n),()->(g)")
def _gimbal_load(rate: Any, angle: Any, eta: Any, speed: Any, Jw: Any, load: Any) -> None:
    s, gi, _ = _axes(angle)
    w = (rate[0] + eta[1] * gi[0], rate[1] + eta[1] * gi[1], rate[2] + eta[0])
    h, dh = Jw * speed[0], Jw * eta[2]
    x = w[1] * h * s[2] - w[2] * h * s[1] + dh * s[0]
    y = w[2] * h * s[0] - w[0] * h * s[2] + dh * s[1]
    z = w[0] * h * s[1] - w[1] * h * s[0] + dh * s[2]
    load[0], load[1] = z, gi[0] * x + gi[1] * y


@gufunc(["void(f8[:,:],f8[:],f8[:],f8[:],f8,f8[:])"], "(v,v),(v),(g),(n),()->(v)")
def _momentum(inertia: Any, rate: Any, angle: Any, speed: Any, Jw: Any, momentum: Any) -> None:
    s, _, _ = _axes(angle)
    for i in range(3):
        momentum[i] = _dot(inertia[i], rate) + Jw * speed[0] * s[i]


@gufunc(["void(f8[:],f8[:],f8[:],f8[:])"], "(v),(g),(g)->(v)")
def _carried(rate: Any, angle: Any, turn: Any, carried: Any) -> None:
    s, _, _ = _axes(angle)
    carried[0] = carried[1] = 0.0
    carried[2] = _dot(s, rate) + s[2] * turn[0]
