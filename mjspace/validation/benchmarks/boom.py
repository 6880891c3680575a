"""Booms deployed from a spinning bus, which slows down: pure spin, and nutation."""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

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
from mjspace.validation.kinematics import quaternion_slope

INERTIA = np.array([8.0, 9.0, 10.0])  # kg m^2: the bus with the tips' own, not their distance
TIP = 2.0  # kg, each of two
STOWED = 0.5  # m from the bus's centre
PACE = 0.125  # m/s
DURATION = 20.0  # s, to 3 m
SPIN = np.array([0.0, 0.0, 1.0])  # rad/s
NUTATION = np.array([0.15, -0.2, 1.0])  # rad/s


def length(time: Array) -> Array:
    """Return the tips' distance from the centre [m]."""
    return STOWED + PACE * time


def exact_spin(time: Array) -> tuple[Array, Array]:
    """Return rate [rad/s] and angle [rad] about z of the bus that spins about it alone.

    H = (I0 + 2 m r^2) w, and r grows evenly: the angle is an arc tangent.
    """
    moment = INERTIA[2] + 2.0 * TIP * length(time) ** 2
    momentum = (INERTIA[2] + 2.0 * TIP * STOWED**2) * SPIN[2]
    scale = np.sqrt(2.0 * TIP / INERTIA[2])
    swept = np.arctan(scale * length(time)) - np.arctan(scale * STOWED)
    return momentum / moment, momentum * swept / (PACE * scale * INERTIA[2])


def exact_work() -> float:
    """Return the drives' work [J]: the change of kinetic energy, H (w - w0) / 2."""
    rate = exact_spin(np.array([0.0, DURATION]))[0]
    return float(0.5 * (INERTIA[2] + 2.0 * TIP * STOWED**2) * rate[0] * (rate[1] - rate[0]))


def exact_nutation(time: Array) -> tuple[Array, Array]:
    """Return rates (n, 3) [rad/s] and attitudes (n, 4), by an independent integration.

    Euler's equations with I(t) = I0 + 2 m r^2 diag(0, 1, 1), the booms along x:
    I w' = -I' w - w x (I w).
    """

    def slope(at: float, state: Array) -> list[float]:
        x, y, z, q0, q1, q2, q3 = state
        r = STOWED + PACE * at
        far, grows = 2.0 * TIP * r * r, 4.0 * TIP * r * PACE
        A, B, C = INERTIA[0], INERTIA[1] + far, INERTIA[2] + far
        return [
            (B - C) * y * z / A,
            ((C - A) * z * x - grows * y) / B,
            ((A - B) * x * y - grows * z) / C,
            *quaternion_slope(q0, q1, q2, q3, x, y, z),
        ]

    begin = [*NUTATION, 1.0, 0.0, 0.0, 0.0]
    solved = solve_ivp(slope, (0.0, time[-1]), begin, "DOP853", t_eval=time, rtol=1e-13, atol=1e-15)
    return solved.y[:3].T, solved.y[3:].T


def deploy(conditions: Conditions) -> Readings:
    """Deploy on a bus that spins about its axis."""
    record = _fly(conditions, SPIN)
    rate, angle = exact_spin(record.time)
    turned = 2.0 * np.unwrap(np.arctan2(record.qpos[:, 6], record.qpos[:, 3]), period=np.pi)
    energy = meter.kinetic_energy(record)
    off = np.abs(record.qvel[:, 5] - rate)
    return Readings(
        values={
            "rate": off.max(),
            "angle": np.abs(turned - angle).max(),
            "length": _length_error(record),
            "momentum": meter.drift(meter.angular_momentum(record)),
            "work": energy[-1] - energy[0],
        },
        motion=Picture.of("rate [rad/s]", record.time, "w3", rate[:, None], record.qvel[:, 5:6]),
        error=Curve("rate error [rad/s]", record.time, off),
    )


def deploy_nutating(conditions: Conditions) -> Readings:
    """Deploy on a bus that nutates."""
    record = _fly(conditions, NUTATION)
    rates, attitudes = exact_nutation(record.time)
    off = attitude.rotation_angle(record.qpos[:, 3:7], attitudes)
    return Readings(
        values={
            "attitude": off.max(),
            "rate": np.abs(record.qvel[:, 3:6] - rates).max(),
            "length": _length_error(record),
            "momentum": meter.drift(meter.angular_momentum(record)),
        },
        motion=Picture.of("rate [rad/s]", record.time, "w1 w2 w3", rates, record.qvel[:, 3:6]),
        error=Curve("attitude error [rad]", record.time, off),
    )


def _fly(conditions: Conditions, rate: Array) -> stand.Record:
    """Deploy both booms at constant speed: the drives balance the centrifugal force."""
    model = stand.build(conditions, "boom")
    data = stand.start(model)
    data.qvel[3:6] = rate
    data.qvel[6:8] = PACE
    sign = 1.0 if conditions.fault == "sign" else -1.0
    force = np.zeros(8)

    def drive(model: Any, data: Any, time: float) -> Array:
        _, y, z = data.qvel[3:6].tolist()
        for joint in (6, 7):
            force[joint] = sign * TIP * data.qpos[joint + 1] * (y * y + z * z)
        return force

    return stand.fly(conditions, model, data, DURATION, load=drive)


def _length_error(record: stand.Record) -> float:
    return float(np.abs(record.qpos[:, 7:9] - length(record.time)[:, None]).max())


BENCHMARKS = (
    Benchmark(
        name="boom",
        title="Booms deployed on a spinning bus",
        shows=(
            "A deploying bus slows down as its momentum requires, and the drives' work is right: "
            "MuJoCo is accurate for masses that move far. Euler's total momentum is off by 4 parts "
            "in 10 000 without an external torque."
        ),
        source="classic closed form, derived here: H = (I0 + 2 m r^2) w with r = r0 + v t",
        step=0.01,
        bounds=(
            Bound(
                "rate",
                "rad/s",
                1e-12,
                "it changes within 20 s: (h / 20 s)^4 is 6e-14; 6e-15 measured",
            ),
            Bound("angle", "rad", 1e-11, "the rate's over 20 s; 6e-14 measured"),
            Bound("length", "m", 2e-12, "force and pull cancel, 2000 roundings; 1.4e-13 measured"),
            Bound("momentum", "of the bus", 1e-11, "turned with the attitude; 5e-14 measured"),
            Bound(
                "work", "J", 1e-11, "of 7.5 J kinetic, as the rate; 8e-14 measured", exact_work()
            ),
        ),
        fly=deploy,
        catches={
            "sign": "the drives push outwards with the force that should hold the booms back",
            "integrator": "",
            "held": "",
            "inertia": "",
        },
        order=Order(("rate", "angle"), (0.4, 0.2, 0.1)),
    ),
    Benchmark(
        name="boom-nutation",
        title="Booms deployed on a nutating bus",
        shows=(
            "The same in three dimensions: moments of inertia that change while the bus nutates. "
            "MuJoCo computes the changing inertia from the bodies; I'(t) need not be written."
        ),
        source="Euler's equations with a moment of inertia that changes, integrated independently",
        step=0.01,
        bounds=(
            Bound("attitude", "rad", 5e-9, "w t (w h)^4 / 120 is 2e-9; 3e-12 measured"),
            Bound("rate", "rad/s", 1e-10, "3e-14 measured; DOP853's own is 1e-13"),
            Bound("length", "m", 2e-12, "force and pull cancel, 2000 roundings; 1.4e-13 measured"),
            Bound(
                "momentum", "of the bus", 3e-10, "as the attitude, which turns it; 3e-12 measured"
            ),
        ),
        fly=deploy_nutating,
        catches={
            "sign": "the drives push outwards with the force that should hold the booms back",
            "integrator": "",
            "held": "",
            "inertia": "",
        },
        order=Order(("attitude", "rate"), (0.4, 0.2, 0.1)),
    ),
)
