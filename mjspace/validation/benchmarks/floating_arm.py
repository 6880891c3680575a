"""Attitude by shape change: an arm, and two wheels, whose closed loop rotates their bus."""

from math import cos, pi, sin
from typing import Any

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.validation import meter, stand
from mjspace.validation.benchmark import (
    Benchmark,
    Bound,
    Conditions,
    Curve,
    Order,
    Picture,
    Readings,
)

MASS = np.array([50.0, 6.0, 4.0])  # kg: base, upper arm, forearm
SHOULDER, UPPER, FORE = 0.5, 1.2, 1.0  # m: from the base's centre of mass; lengths
INERTIA = np.array([8.0, 6.0 * UPPER**2 / 12.0, 4.0 * FORE**2 / 12.0])  # kg m^2; thin rods
LOOP = 20.0  # s, from rest to rest
STIFFNESS, DAMPING = 4.0, 4.0  # 1/s^2 and 1/s: joint errors decay critically damped, at 2 rad/s
START = np.array([1.5, 0.5])  # rad, shoulder and elbow: 0.8 + 0.7 cos u and 0.5 + 0.9 sin u

WHEEL = 0.05  # kg m^2, axial
WHOLE = np.array([10.0, 12.0])  # kg m^2 about x and y, wheels included
TURN = 40.0  # rad, of each wheel: x, y, x back, y back
REDUCED = WHEEL * (WHOLE - WHEEL) / WHOLE  # kg m^2: between motor torque and relative angle


def _metric() -> Array:
    """Return h (3, 3) [kg m^2]: twice the energy is sum h_ij cos(phi_i - phi_j) phi_i' phi_j'.

    phi are the angles of base, upper arm and forearm in the plane; the centre of mass rests.
    """
    reach = np.array([[0.0, 0.0, 0.0], [SHOULDER, UPPER / 2, 0.0], [SHOULDER, UPPER, FORE / 2]])
    about_centre = reach - MASS @ reach / MASS.sum()
    return np.asarray(about_centre.T @ (MASS[:, None] * about_centre) + np.diag(INERTIA))


METRIC = _metric()
(H00, H01, H02), (_, H11, H12), (_, _, H22) = METRIC.tolist()


def quintic(x: Any) -> tuple[Any, Any, Any]:
    """Return a path from rest to rest at ``x``, 0 to 1, and its first two derivatives."""
    y = x * (1.0 - x)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * y * y, 60.0 * y * (1.0 - 2.0 * x)


def base_angle(phases: Array) -> Array:
    """Return the base's angle [rad] at ``phases`` [rad] (n,) of the loop, 0 at the first.

    Without momentum, sum_ij h_ij cos(phi_i - phi_j) phi_j' = 0: time is not in it. Gauss-Legendre
    between the phases.
    """

    def slope(u: Array) -> Array:
        q1, q2 = 0.8 + 0.7 * np.cos(u), 0.5 + 0.9 * np.sin(u)
        d1, d2 = -0.7 * np.sin(u), 0.9 * np.cos(u)
        phi = np.stack([0.0 * u, q1, q1 + q2], axis=-1)
        share = np.sum(METRIC * np.cos(phi[..., :, None] - phi[..., None, :]), axis=-2)
        moved = share[..., 1] * d1 + share[..., 2] * (d1 + d2)
        return np.asarray(-moved / share.sum(axis=-1))

    nodes, weights = np.polynomial.legendre.leggauss(10)
    half = np.diff(phases) / 2.0
    inside = (phases[:-1] + half)[:, None] + half[:, None] * nodes
    return np.concatenate([[0.0], np.cumsum(half * (slope(inside) @ weights))])


def joint_torques(
    q1: float, q2: float, w: float, d1: float, d2: float, a1: float, a2: float
) -> tuple[float, float]:
    """Return the joint torques [N m] for the joint accelerations ``a1``, ``a2`` [rad/s^2].

    Lagrange's equations of the three angles; the base's acceleration follows, for nothing pushes
    the whole. ``w`` is the base's rate, ``d1`` and ``d2`` are the joints' [rad/s].
    """
    k01, k02, k12 = H01 * cos(q1), H02 * cos(q1 + q2), H12 * cos(q2)
    s01, s02, s12 = H01 * sin(q1), H02 * sin(q1 + q2), H12 * sin(q2)
    v0, v1, v2 = w * w, (w + d1) ** 2, (w + d1 + d2) ** 2
    row0 = k01 * a1 + k02 * (a1 + a2) - s01 * v1 - s02 * v2
    row1 = H11 * a1 + k12 * (a1 + a2) + s01 * v0 - s12 * v2
    row2 = k12 * a1 + H22 * (a1 + a2) + s02 * v0 + s12 * v1
    share1, share2 = k01 + H11 + k12, k02 + k12 + H22
    base = -(row0 + row1 + row2) / (H00 + k01 + k02 + share1 + share2)
    elbow = row2 + share2 * base
    return row1 + share1 * base + elbow, elbow


def fly_arm(conditions: Conditions) -> Readings:
    """Move the arm around its loop by computed torque, three times in a minute."""
    loops = 1 if conditions.short else 3
    direction = -1.0 if conditions.fault == "sign" else 1.0
    torque = np.zeros(8)

    def drive(_: Any, data: Any, time: float) -> Array:
        count = min(int(time / LOOP), loops - 1)
        way, pace, push = quintic(time / LOOP - count)
        u, du, ddu = (2.0 * pi * direction * v for v in (way, pace / LOOP, push / LOOP**2))
        c, s = cos(u), sin(u)
        (q1, q2), (w, d1, d2) = data.qpos[7:9].tolist(), data.qvel[5:8].tolist()
        a1 = -0.7 * (s * ddu + c * du * du) + servo(0.8 + 0.7 * c - q1, -0.7 * s * du - d1)
        a2 = 0.9 * (c * ddu - s * du * du) + servo(0.5 + 0.9 * s - q2, 0.9 * c * du - d2)
        torque[6:] = joint_torques(q1, q2, w, d1, d2, a1, a2)
        return torque

    def servo(off: float, off_rate: float) -> float:
        return STIFFNESS * off + DAMPING * off_rate

    model = stand.build(conditions, "floating_arm")
    data = stand.start(model)
    data.qpos[7:9] = START
    record = stand.fly(conditions, model, data, loops * LOOP, load=drive)
    flown = 2.0 * np.arctan2(record.qpos[:, 6], record.qpos[:, 3])
    past, now = np.divmod(record.time / LOOP, 1.0)
    truth = base_angle(2.0 * pi * (past + quintic(now)[0]))
    off = np.abs(flown - truth)
    return Readings(
        values={
            "angle a loop": float(flown[-1] / loops),
            "attitude": off.max(),
            "momentum": float(np.abs(meter.angular_momentum(record)).max()),
            "linear momentum": float(np.abs(meter.linear_momentum(record)).max()),
        },
        motion=Picture.of(
            "angle of the base [rad]", record.time, "base", truth[:, None], flown[:, None]
        ),
        error=Curve("attitude error [rad]", record.time, off),
    )


def wheel_attitude(progress: Array) -> Array:
    """Return attitudes (n, 4) at the ``progress`` (n,) of the wheels, 0 to 4 turns.

    Without momentum the bus turns by -Jw / I of a wheel's own turn, about that wheel's axis.
    """
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for turn in range(4):
        way = quintic(np.clip(progress - turn, 0.0, 1.0))[0]
        angle = -WHEEL / WHOLE[turn % 2] * wheel_turn(turn) * way
        about = np.eye(3)[turn % 2]
        q = attitude.multiply(q, attitude.from_rotation_vector(angle[:, None] * about))
    return q


def wheel_turn(turn: int) -> float:
    """Return the angle [rad] of that turn of a wheel: two forwards, two back."""
    return TURN if turn < 2 else -TURN


def fly_wheels(conditions: Conditions) -> Readings:
    """Turn one wheel, then the other, then both back, in a minute."""
    period = 5.0 if conditions.short else 15.0
    signs = (1.0, -1.0 if conditions.fault == "sign" else 1.0)
    torque = np.zeros(8)

    def drive(_: Any, __: Any, time: float) -> Array:
        turn = min(int(time / period), 3)
        wheel = turn % 2
        push = quintic(time / period - turn)[2] / period**2
        torque[6:] = 0.0
        torque[6 + wheel] = signs[wheel] * REDUCED[wheel] * wheel_turn(turn) * push
        return torque

    model = stand.build(conditions, "two_wheels")
    record = stand.fly(conditions, model, stand.start(model), 4.0 * period, load=drive)
    flown, truth = record.qpos[:, 3:7], wheel_attitude(record.time / period)
    off = attitude.rotation_angle(flown, truth)
    return Readings(
        values={
            "angle": float(attitude.rotation_angle(flown[-1], flown[0])),
            "attitude": off.max(),
            "wheels": float(np.abs(record.qpos[-1, 7:]).max()),
            "momentum": float(np.abs(meter.angular_momentum(record)).max()),
        },
        motion=Picture.of("attitude", record.time, "q1 q2 q3", truth[:, 1:], flown[:, 1:]),
        error=Curve("attitude error [rad]", record.time, off),
    )


_END = wheel_attitude(np.array([0.0, 4.0]))

BENCHMARKS = (
    Benchmark(
        name="floating-arm",
        title="Free-floating arm",
        shows=(
            "A robot arm that returns to its initial pose has rotated its satellite by 3.7 "
            "degrees, at any speed: attitude without external torque. Torques held over a step "
            "cause errors of 1e-4 rad on the way, and Euler creates momentum."
        ),
        source=(
            "Papadopoulos and Dubowsky, On the nature of control algorithms for free-floating "
            "space manipulators, 1991; the plane's equations, derived here"
        ),
        step=0.01,
        bounds=(
            Bound("angle a loop", "rad", 5e-9, "as the attitude; 4e-10 measured", -0.064650552050),
            Bound("attitude", "rad", 5e-9, "grows with the momentum; 1.2e-9 measured"),
            Bound("momentum", "N m s", 1e-8, "a torque's error of h^4 each step; 9e-10 measured"),
            Bound("linear momentum", "N s", 2e-8, "the same; 2e-9 measured"),
        ),
        fly=fly_arm,
        catches={
            "sign": "the loop gone round backwards",
            "armature": "",
            "integrator": "",
            "held": "",
            "inertia": "",
        },
        order=Order(("attitude",), (0.08, 0.04, 0.02)),
    ),
    Benchmark(
        name="wheel-loop",
        title="Two wheels round a loop",
        shows=(
            "Two reaction wheels that turn forwards and back, one after the other, rotate their "
            "satellite about an axis that is neither wheel's: rotations do not commute."
        ),
        source="classic closed form, derived here: w = -Jw/I of the wheel's speed without momentum",
        step=0.01,
        bounds=(
            Bound(
                "angle",
                "rad",
                5e-11,
                "1.904493692 degrees; 1e-14 measured, 4e-12 in a short flight",
                float(attitude.rotation_angle(_END[1], _END[0])),
            ),
            Bound("attitude", "rad", 5e-11, "of 5e-7 with Euler; 5e-14 measured, 4e-12 in short"),
            Bound("wheels", "rad", 1e-11, "back where they were; 1e-12 measured, rounding"),
            Bound("momentum", "N m s", 1e-12, "zero, as at the start; 1e-14 measured"),
        ),
        fly=fly_wheels,
        catches={
            "sign": "the second wheel's torque reversed",
            "armature": "",
            "integrator": "",
            "held": "",
            "inertia": "",
        },
    ),
)
