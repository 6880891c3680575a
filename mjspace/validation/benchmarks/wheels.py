"""A bus and one wheel: momentum exchanged by the motor, and a fast wheel's stiffness."""

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

AXIAL = 0.01  # kg m^2, of the wheel, about z
BUS = np.array([10.006, 12.006, 14.0])  # kg m^2, with the wheel's transverse inertia of 0.006

TORQUE = 0.2  # N m, of the motor that spins the wheel up

SPEED = 600.0  # rad/s, of the fast wheel relative to the bus
RATE = np.array([0.02, -0.015, 0.03])  # rad/s, of its bus


def exact_spin_up(time: Array) -> tuple[Array, Array, Array, Array]:
    """Return bus rate, wheel speed [rad/s], bus angle [rad] and work [J] of a motor, each (n,).

    From rest, about the wheel's own axis: tau = Jw (w' + Omega') = -Ib w'.
    """
    rate = -TORQUE * time / BUS[2]
    speed = TORQUE * time * (1.0 / AXIAL + 1.0 / BUS[2])
    return rate, speed, 0.5 * rate * time, 0.5 * TORQUE * speed * time


def exact_gyrostat(time: Array) -> tuple[Array, Array]:
    """Return rates (n, 3) [rad/s] and attitudes (n, 4) at ``time`` (n,), from the identity at 0.

    I w' = -w x (I w + h), where h = Jw (Omega + w3) along z is constant, for no motor turns the
    wheel.  Hughes, Spacecraft Attitude Dynamics, 1986, chapter 6; integrated here.
    """
    h = AXIAL * (SPEED + RATE[2])

    def derivative(_: float, y: Array) -> tuple[float, ...]:
        q0, q1, q2, q3, w1, w2, w3 = y.tolist()
        p1, p2, p3 = BUS[0] * w1, BUS[1] * w2, BUS[2] * w3 + h
        return (
            *quaternion_slope(q0, q1, q2, q3, w1, w2, w3),
            (p2 * w3 - p3 * w2) / BUS[0],
            (p3 * w1 - p1 * w3) / BUS[1],
            (p1 * w2 - p2 * w1) / BUS[2],
        )

    start = [1.0, 0.0, 0.0, 0.0, *RATE]
    end = time[-1]
    y = solve_ivp(derivative, (0.0, end), start, "DOP853", time, rtol=1e-13, atol=1e-15).y.T
    return y[:, 4:], attitude.normalize(y[:, :4])


def spin_up(conditions: Conditions) -> Readings:
    """Spin up the wheel by its motor, whose reaction turns the bus."""
    model = stand.build(conditions, "bus_wheel")
    data = stand.start(model)
    data.ctrl[0] = -TORQUE if conditions.fault == "sign" else TORQUE
    record = stand.fly(conditions, model, data, 20.0)
    rate, speed, angle, work = exact_spin_up(record.time)
    attitudes = attitude.from_rotation_vector(angle[:, None] * np.eye(3)[2])
    off = attitude.rotation_angle(record.qpos[:, 3:7], attitudes)
    momentum = meter.angular_momentum(record)
    return Readings(
        values={
            "bus rate": np.abs(record.qvel[:, 3:6] - rate[:, None] * np.eye(3)[2]).max(),
            "wheel speed": np.abs(record.qvel[:, 6] - speed).max(),
            "bus angle": off.max(),
            "work": np.abs(meter.kinetic_energy(record) - work).max() / work[-1],
            "momentum": meter.drift(momentum, scale=TORQUE * record.time[-1]),
        },
        motion=Picture.of(
            "bus angle [rad], rate [rad/s]",
            record.time,
            "angle rate",
            np.stack([angle, rate], axis=1),
            np.stack([2.0 * np.arctan2(*record.qpos[:, [6, 3]].T), record.qvel[:, 5]], axis=1),
        ),
        error=Curve("bus angle error [rad]", record.time, off),
    )


def stiffen(conditions: Conditions) -> Readings:
    """Fly a tumbling bus that is gyroscopically stiffened by a fast wheel."""
    model = stand.build(conditions, "bus_wheel")
    data = stand.start(model)
    data.qvel[3:6], data.qvel[6] = RATE, SPEED
    minute = stand.fly(conditions, model, data, 60.0)
    rest = [] if conditions.short else [stand.fly(conditions, model, data, 940.0)]
    record, drawn = stand.joined(minute, *rest), len(minute.time)
    rates, attitudes = exact_gyrostat(record.time)
    flown = record.qvel[:, 3:6]
    off = attitude.rotation_angle(record.qpos[:, 3:7], attitudes)
    of_bus = float(np.linalg.norm(BUS * RATE))
    return Readings(
        values={
            "attitude": off.max(),
            "bus rate": np.abs(flown - rates).max(),
            "momentum": meter.drift(meter.angular_momentum(record), scale=of_bus),
            "bus energy": meter.drift(0.5 * flown**2 @ BUS),
        },
        motion=Picture.of(
            "bus rate [rad/s]", minute.time, "w1 w2 w3", rates[:drawn], flown[:drawn]
        ),
        error=Curve("attitude error [rad]", record.time, off),
    )


BENCHMARKS = (
    Benchmark(
        name="wheel-spin-up",
        title="Momentum exchange of a bus and its wheel",
        shows=(
            "A motor between two bodies transfers momentum to rounding. With the rotor's inertia "
            "as armature the total momentum is conserved as well, but the bus hardly turns: the "
            "rates, not the total, are the test."
        ),
        source="Momentum and angular impulse; closed form, derived here",
        step=0.01,
        bounds=(
            Bound("bus rate", "rad/s", 1e-12, "constant torque, exact; 4e-15 measured"),
            Bound(
                "wheel speed", "rad/s", 2e-10, "2000 roundings of 400 rad/s: 1e-10; 1e-11 measured"
            ),
            Bound("bus angle", "rad", 1e-12, "RK4 is exact for a parabola; 3e-14 measured"),
            Bound("work", "of the whole", 1e-12, "the rates', twice; 5e-14 measured"),
            Bound("momentum", "of the bus", 1e-12, "nothing from outside; 3e-14 measured"),
        ),
        fly=spin_up,
        catches={
            "sign": "the motor has the torque on the bus instead of its reaction",
            "armature": "",
            "integrator": "",
            "inertia": "",
        },
    ),
    Benchmark(
        name="fast-wheel",
        title="A bus made stiff by a fast wheel",
        shows=(
            "A wheel at 600 rad/s needs no small step: it turns 6 rad in each, but the step is set "
            "by the bus's nutation. Momentum and energy errors are relative to the bus's own; "
            "relative to the wheel's, Euler has an energy error of 1e-6 with a bus rate that is 6 "
            "% wrong after a minute."
        ),
        source=(
            "Gyrostat equations (Hughes, Spacecraft Attitude Dynamics, 1986, chapter 6), "
            "integrated by DOP853 to 1e-13"
        ),
        step=0.01,
        bounds=(
            Bound(
                "attitude",
                "rad",
                2e-9,
                "nutation of 0.05 rad with RK4's phase error l t (l h)^4 / 120 = 5e-9 after 1000 s "
                "is 2e-10; 2e-10 measured",
            ),
            Bound(
                "bus rate",
                "rad/s",
                1e-9,
                "the same phase error; 1.1e-10 measured after 1000 s, 6e-12 after a minute",
            ),
            Bound(
                "momentum",
                "of the bus",
                5e-11,
                "rounding of the wheel's, 12 times as large; 5e-12 measured",
            ),
            Bound(
                "bus energy",
                "of the bus",
                2e-10,
                "RK4 damps nutation at l^6 h^5 / 144: 4e-11 after 1000 s; 1.7e-11 measured, 1.4e-12"
                " after a minute",
            ),
        ),
        fly=stiffen,
        catches={"armature": "", "integrator": "", "inertia": ""},
        order=Order(("attitude", "bus rate"), (0.1, 0.05, 0.025)),
    ),
)
