"""Libration of a satellite under the gravity gradient, with large and small amplitudes."""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from scipy.special import ellipk

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.constants import GM
from mjspace.environment.orbit import Orbit
from mjspace.scenario.environment import Environment
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

ORBIT_PERIOD = 5700.0  # s: a circular orbit at 518 km
RATE = 2.0 * np.pi / ORBIT_PERIOD  # rad/s
TILT = 1.7  # rad, of the orbit: sun-synchronous, nearly
ORBIT = Orbit(semi_major_axis=(GM["earth"] / RATE**2) ** (1 / 3), inclination=TILT)

INERTIA = np.array([12.0, 14.0, 5.0])  # kg m^2: about roll, pitch, yaw
RELEASE = np.array([0.3, 0.4, -0.3])  # rad, a rotation vector from LVLH; at rest in LVLH
SMALL = 1e-5  # rad: nonlinear terms are 1e-10 of it
SWING = np.radians(30.0)


def lvlh(time: Array) -> Array:
    """Return the attitudes (n, 4) of the orbit's own axes at ``time`` (n,) [s].

    They are o1 along the velocity (roll), o2 against the orbit's normal (pitch), o3 down (yaw).
    """
    ascending = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    plane = attitude.from_rotation_vector(np.array([TILT, 0.0, 0.0]))
    along = attitude.from_rotation_vector(RATE * time[:, None] * np.array([0.0, 0.0, 1.0]))
    return attitude.multiply(attitude.multiply(plane, along), attitude.from_matrix(ascending))


def orbital_rate(q: Array) -> Array:
    """Return the rate [rad/s] of the orbit's axes, in axes whose attitude in them is ``q``."""
    return attitude.rotate(attitude.conjugate(q), np.array([0.0, -RATE, 0.0]))


def librate(
    conditions: Conditions,
    model: Any,
    state: Array,
    duration: float,
    samples: int = 200,
) -> tuple[Array, Array, Array]:
    """Fly ``model`` from ``state``: a rotation vector [rad] from LVLH and a rate in LVLH [rad/s].

    Returns times (n,) [s], and attitudes (n, 4) and rates (n, 3) [rad/s], body axes, from LVLH.
    """
    data = stand.start(model, Environment(orbit=ORBIT))
    q = attitude.from_rotation_vector(state[:3])
    data.qpos[3:7] = attitude.multiply(lvlh(np.zeros(1))[0], q)
    orbital = orbital_rate(q)
    data.qvel[3:6] = state[3:] + (-orbital if conditions.fault == "sign" else orbital)
    record = stand.fly(conditions, model, data, duration, samples=samples)
    relative = attitude.multiply(attitude.conjugate(lvlh(record.time)), record.qpos[:, 3:7])
    return record.time, relative, record.qvel[:, 3:6] - orbital_rate(relative)


def exact_libration(release: Array, time: Array) -> Array:
    """Return the attitudes (n, 4) from LVLH of the body released at rest in LVLH, by DOP853.

    Euler's equations with the torque 3 n^2 o3 x I o3; Wertz, Spacecraft Attitude Determination and
    Control, 1978, section 17.2.1. Plain numbers: quaternion, then rate relative to LVLH.
    """
    I1, I2, I3 = INERTIA.tolist()
    n = float(RATE)

    def motion(_: float, state: Array) -> list[float]:
        a, b, c, d, x, y, z = state.tolist()
        # o2 and o3 in body axes
        p1, p2, p3 = 2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)
        u1, u2, u3 = 2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d
        w1, w2, w3 = x - n * p1, y - n * p2, z - n * p3
        k = 3 * n * n
        return [
            *quaternion_slope(a, b, c, d, x, y, z),
            # the rate of LVLH, constant there, turns in body axes: p' = p x (x, y, z)
            (I3 - I2) * (k * u2 * u3 - w2 * w3) / I1 + n * (p2 * z - p3 * y),
            (I1 - I3) * (k * u3 * u1 - w3 * w1) / I2 + n * (p3 * x - p1 * z),
            (I2 - I1) * (k * u1 * u2 - w1 * w2) / I3 + n * (p1 * y - p2 * x),
        ]

    start = [*attitude.from_rotation_vector(release), 0.0, 0.0, 0.0]
    flown = solve_ivp(motion, time[[0, -1]], start, "DOP853", time, rtol=1e-13, atol=1e-16)
    return attitude.normalize(flown.y[:4].T)


def eigenvalues(states: Array, interval: float) -> Array:
    """Return the eigenvalues [1/s] of a linear motion from its ``states`` (n, k).

    The states are ``interval`` [s] apart. Least squares of the transition matrix, without theory.
    """
    scaled = states / np.abs(states).max(axis=0)
    step, *_ = np.linalg.lstsq(scaled[:-1], scaled[1:], rcond=None)
    return np.asarray(np.log(np.linalg.eigvals(step).astype(complex)) / interval)


def swing_period(amplitude: float) -> float:
    """Return the period [s] of a pitch libration, a pendulum's of twice the angle."""
    I1, I2, I3 = INERTIA
    pace = RATE * np.sqrt(3.0 * (I1 - I3) / I2)
    return float(4.0 * ellipk(np.sin(amplitude) ** 2) / pace)


def roll_yaw_frequencies() -> Array:
    """Return both frequencies, over the orbit's, of small librations of roll and yaw together."""
    I1, I2, I3 = INERTIA
    k1, k3 = (I2 - I3) / I1, (I2 - I1) / I3
    return np.sort(np.sqrt(-np.roots([1.0, 1.0 + 3.0 * k1 + k1 * k3, 4.0 * k1 * k3])))


def fly(conditions: Conditions) -> Readings:
    """Release the satellite from four states and compare each flight with the exact motion."""
    model = stand.build(conditions, "orbiter", outside=Environment(orbit=ORBIT))
    duration = (0.5 if conditions.short else 2.0) * ORBIT_PERIOD
    time, q, rate = librate(conditions, model, np.concatenate([RELEASE, np.zeros(3)]), duration)
    exact = exact_libration(RELEASE, time)
    off = attitude.rotation_angle(q, exact)
    slow, fast = _frequencies(conditions, model, [0, 2])
    return Readings(
        values={
            "attitude": off.max(),
            "Jacobi's integral": meter.drift(_jacobi(q, rate)),
            "swing": _swing(conditions, model),
            "pitch": _frequencies(conditions, model, [1])[0],
            "slow roll-yaw": slow,
            "fast roll-yaw": fast,
        },
        motion=Picture.of(
            "rotation from LVLH [rad]",
            time,
            "roll pitch yaw",
            attitude.to_rotation_vector(exact),
            attitude.to_rotation_vector(q),
        ),
        error=Curve("attitude error [rad]", time, off),
    )


def _jacobi(q: Array, rate: Array) -> Array:
    """Return the integral of motion on a circular orbit [J], from LVLH attitudes and rates."""
    against, down = (attitude.rotate(attitude.conjugate(q), axis) for axis in np.eye(3)[1:])
    return np.asarray(0.5 * (rate**2 + RATE**2 * (3.0 * down**2 - against**2)) @ INERTIA)


def _swing(conditions: Conditions, model: Any) -> float:
    """Return the measured period [s] of pitch, released at 30 deg: twice from zero to zero."""
    state = np.array([0.0, SWING, 0.0, 0.0, 0.0, 0.0])
    duration = 0.8 * swing_period(SWING)
    samples = round(duration / conditions.step)
    time, q, rate = librate(conditions, model, state, duration, samples)
    pitch = attitude.to_rotation_vector(q)[:, 1]
    zeros = CubicHermiteSpline(time, pitch, rate[:, 1]).roots(extrapolate=False)
    return 2.0 * float(zeros[1] - zeros[0]) if len(zeros) > 1 else np.nan


def _frequencies(conditions: Conditions, model: Any, axes: list[int]) -> Array:
    """Return the measured frequencies of small librations about ``axes``, over the orbit's."""
    state = np.zeros(6)
    state[axes] = SMALL
    interval, samples = 40.0, 70 if conditions.short else 140
    _, q, rate = librate(conditions, model, state, samples * interval, samples)
    angles = attitude.to_rotation_vector(q)
    states = np.concatenate([angles[:, axes], rate[:, axes]], axis=1)
    return np.sort(eigenvalues(states, interval).imag)[len(axes) :] / RATE


BENCHMARKS = (
    Benchmark(
        name="gravity-gradient",
        title="Libration under the gravity gradient",
        shows=(
            "With the native gravity gradient, evaluated in every stage of RK4, two orbits of "
            "large libration are exact to rounding. A torque held over the step loses nine digits."
        ),
        source=(
            "Euler's equations by DOP853 at 1e-13; frequencies and the pendulum of pitch: Hughes, "
            "Spacecraft Attitude Dynamics, 1986, chapter 9"
        ),
        step=1.0,
        bounds=(
            Bound(
                "attitude",
                "rad",
                1e-11,
                "1 s is 1/900 rad of the orbit, which sets the pace: n t (1.8 n h)^4 / 120 is "
                "2e-12; 6e-13 measured",
            ),
            Bound("Jacobi's integral", "of its start", 1e-12, "9e-14 measured: 11,400 roundings"),
            Bound(
                "swing",
                "s",
                1e-9,
                "period of a pitch of 30 deg: its phase as the attitude's; 1e-10 measured",
                swing_period(SWING),
            ),
            Bound(
                "pitch",
                "of the orbital rate",
                1e-9,
                "nonlinear terms at 1e-5 rad are 1e-10, and so is rounding; 1e-10 measured",
                2.0 * np.pi / swing_period(0.0) / RATE,
            ),
            Bound(
                "slow roll-yaw",
                "of the orbital rate",
                1e-9,
                "as pitch; 9e-11 measured",
                roll_yaw_frequencies()[0],
            ),
            Bound(
                "fast roll-yaw",
                "of the orbital rate",
                1e-9,
                "as pitch; 3e-11 measured",
                roll_yaw_frequencies()[1],
            ),
        ),
        fly=fly,
        catches={
            "sign": "the orbital rate of the release added the wrong way round",
            "armature": "",
            "integrator": "",
            "held": "",
            "inertia": "",
        },
        order=Order(("attitude",), (40.0, 20.0, 10.0)),
    ),
)
