"""Detumbling with magnetorquers against the field's rate of change, the B-dot law."""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.integrate import simpson, solve_ivp

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.constants import GM
from mjspace.environment.orbit import Orbit
from mjspace.validation import stand
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
from mjspace.validation.magnetorquers import b_dot, b_dot_in_orbit

PERIOD = 5800.0  # s: a circular orbit at 599 km
RATE = 2.0 * np.pi / PERIOD  # rad/s
STRENGTH = 7.7e15  # T m^3: the Earth's
RADIUS = (GM["earth"] / RATE**2) ** (1 / 3)  # m
FIELD = STRENGTH / RADIUS**3  # T, on the equator

BALL = 10.0  # kg m^2, equal about every axis, so that the averages have closed forms
TUMBLE = np.array([0.03, 0.02, -0.025])  # rad/s
ORBITS = 6  # in which the fastest component falls to 1/e of itself
GAIN = BALL / (2.5 * FIELD**2 * ORBITS * PERIOD)  # A m^2 s/T

BODY = np.array([12.0, 14.0, 5.0])  # kg m^2, in a constant field
STAYS = np.array([1.2e-5, -2.5e-5, 0.8e-5])  # T
FAST = np.array([0.1, -0.25, 0.2])  # rad/s
STRONG = 0.2 / float(STAYS @ STAYS)  # A m^2 s/T: the tumble stops within a minute
TIMES_FASTER = 500.0  # than along the orbit: 10 ms there for 5 s here


def exact_rates(time: Array) -> Array:
    """Return the ball's rates (n, 3) [rad/s], inertial axes, over the poles in the x-z plane.

    By DOP853 of I w' = -k (dB/dt - w x B) x B, independent of the attitude.
    """

    def slope(at: float, w: Array) -> list[float]:
        two = 2.0 * RATE * at
        x, z = -1.5 * FIELD * np.sin(two), FIELD * (1.5 * np.cos(two) - 0.5)
        wx, wy, wz = w
        a = -3.0 * RATE * FIELD * np.cos(two) - wy * z
        b = wx * z - wz * x
        c = -3.0 * RATE * FIELD * np.sin(two) + wy * x
        return [-GAIN / BALL * m for m in (b * z, c * x - a * z, -b * x)]

    flown = solve_ivp(slope, time[[0, -1]], TUMBLE, "DOP853", time, rtol=1e-13, atol=1e-16)
    return np.asarray(flown.y.T)


def averaged_rates(orbits: int) -> Array:
    """Return the rates (3,) [rad/s] after whole orbits, by the torque's average over each.

    In units of k B0^2 / I the fields give the decay; the field rotates at 1.8 n, the final rate.
    """
    decay = np.exp(-np.array([1.375, 2.5, 1.125]) / 2.5 * orbits / ORBITS)
    left = np.array([0.0, -1.8 * RATE, 0.0])
    return np.asarray(left + decay * (TUMBLE - left))


def exact_tumble(time: Array) -> Array:
    """Return the attitudes (n, 4) of the body in the constant field, by DOP853."""

    I1, I2, I3 = BODY.tolist()
    bx, by, bz = STAYS.tolist()

    def slope(_: float, state: Array) -> list[float]:
        a, b, c, d, x, y, z = state.tolist()
        # v + 2 u x (u x v - a v) takes the field to body axes
        px, py, pz = c * bz - d * by - a * bx, d * bx - b * bz - a * by, b * by - c * bx - a * bz
        fx = bx + 2.0 * (c * pz - d * py)
        fy = by + 2.0 * (d * px - b * pz)
        fz = bz + 2.0 * (b * py - c * px)
        along, square = x * fx + y * fy + z * fz, fx * fx + fy * fy + fz * fz
        return [
            *quaternion_slope(a, b, c, d, x, y, z),
            # k (w x B) x B = k ((w B) B - B^2 w)
            (STRONG * (along * fx - square * x) - (I3 - I2) * y * z) / I1,
            (STRONG * (along * fy - square * y) - (I1 - I3) * z * x) / I2,
            (STRONG * (along * fz - square * z) - (I2 - I1) * x * y) / I3,
        ]

    start = [1.0, 0.0, 0.0, 0.0, *FAST]
    flown = solve_ivp(slope, time[[0, -1]], start, "DOP853", time, rtol=1e-13, atol=1e-15)
    return attitude.normalize(flown.y[:4].T)


def fly(conditions: Conditions) -> Readings:
    """Detumble a ball over six orbits, and a body in a constant field within a minute."""
    sign = -1.0 if conditions.fault == "sign" else 1.0
    orbit = Orbit(semi_major_axis=RADIUS, inclination=0.5 * np.pi).elements()

    def ball(spec: Any) -> None:
        spec.body("bus").inertia = np.full(3, BALL)

    def detumble(_: Any, data: Any, time: float) -> Any:
        axes, w = data.xmat[1], data.qvel[3:6]
        return b_dot_in_orbit(axes, w, orbit, time, STRENGTH, sign * GAIN)

    model = stand.build(conditions, "orbiter", adapt=ball)
    data = stand.start(model)
    data.qvel[3:6] = TUMBLE
    orbits = 2 if conditions.short else ORBITS
    record = stand.fly(conditions, model, data, orbits * PERIOD, load=detumble, samples=40 * orbits)
    rates = attitude.rotate(record.qpos[:, 3:7], record.qvel[:, 3:6])
    exact = exact_rates(record.time)
    off = np.abs(rates - exact).max(axis=1)
    tumble, balance = _in_a_field_that_stays(conditions, sign)
    return Readings(
        values={
            "rate": off.max(),
            "average": np.abs(rates[-1] / averaged_rates(orbits) - 1.0).max(),
            "residual rate": _residual(rates[:: 20 * orbits, 1]),
            "attitude": tumble,
            "energy": balance,
        },
        motion=Picture.of("rate, inertial axes [rad/s]", record.time, "x y z", exact, rates),
        error=Curve("rate error [rad/s]", record.time, off),
    )


def _residual(rates: Array) -> float:
    """Return the limit of three rates about y, whole orbits apart, over n, in the field's sense.

    About y the motion is linear and periodic by itself, so that each is an affine map of the last.
    """
    first, middle, last = rates
    return float((middle**2 - first * last) / (first + last - 2.0 * middle) / RATE)


def _in_a_field_that_stays(conditions: Conditions, sign: float) -> tuple[float, float]:
    """Return the attitude error [rad], and the energy unaccounted for over that at the start."""
    tumbling = replace(conditions, step=conditions.step / TIMES_FASTER)

    def detumble(_: Any, data: Any, time: float) -> Any:
        return b_dot(data.xmat[1], data.qvel[3:6], STAYS, np.zeros(3), sign * STRONG)

    model = stand.build(tumbling, "orbiter")
    data = stand.start(model)
    data.qvel[3:6] = FAST
    duration = 24.0 if conditions.short else 60.0
    samples = round(0.5 * duration / tumbling.step)
    record = stand.fly(tumbling, model, data, duration, load=detumble, samples=samples)
    q, w = record.qpos[:, 3:7], record.qvel[:, 3:6]
    field = attitude.rotate(attitude.conjugate(q), STAYS)
    lost = simpson(STRONG * np.sum(np.cross(w, field) ** 2, axis=1), x=record.time)
    energy = 0.5 * w**2 @ BODY
    at = slice(None, None, samples // 10)
    off = attitude.rotation_angle(q[at], exact_tumble(record.time[at]))
    return off.max(), abs(energy[-1] + lost - energy[0]) / energy[0]


BENCHMARKS = (
    Benchmark(
        name="b-dot",
        title="Detumbling in the Earth's magnetic field",
        shows=(
            "Magnetorquers that oppose the field's change stop a tumble as fast as theory "
            "predicts, down to 1.8 turns an orbit with the field. MuJoCo agrees if the torque is "
            "evaluated in every stage."
        ),
        source=(
            "Stickler and Alfriend, Elementary magnetic attitude control system, 1976; averages "
            "over a polar orbit of a dipole derived here"
        ),
        step=5.0,
        bounds=(
            Bound(
                "rate",
                "rad/s",
                1e-7,
                "a tumble of 0.04 rad/s in steps of 5 s: (w h)^4 / 120 is 1e-5 of a torque that "
                "averages out; 1e-8 measured over six orbits",
            ),
            Bound(
                "average",
                "of each rate",
                0.01,
                "the average over an orbit is itself good to 0.3 %, measured",
            ),
            Bound(
                "residual rate",
                "of the orbital rate",
                0.002,
                "1.8 but for the same; 1e-4 measured",
                1.8,
            ),
            Bound(
                "attitude",
                "rad",
                1e-11,
                "a minute at 0.3 rad/s in a constant field, 10 ms: w t (w h)^4 / 120 is 1e-11; "
                "6e-13 measured",
            ),
            Bound(
                "energy",
                "of its start",
                1e-12,
                "less k |w x B|^2 all along; 6e-14 measured, Simpson's rule included",
            ),
        ),
        fly=fly,
        catches={
            "sign": "m = +k dB/dt, which spins up",
            "armature": "",
            "integrator": "",
            "held": "",
            "inertia": "",
        },
        order=Order(("attitude",), (40.0, 20.0, 10.0)),
    ),
)
