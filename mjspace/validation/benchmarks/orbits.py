"""Free bodies near the orbit of the free-fall frame: Kepler's ellipses, and Hill's motion."""

import numpy as np

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

MU = GM["earth"]

FRAME = Orbit(
    semi_major_axis=8.5e6,
    eccentricity=0.2,
    inclination=0.9,
    ascending_node=2.0,
    periapsis=-1.0,
    true_anomaly=0.4,
)
BODY = FRAME.model_copy(update={"inclination": 0.8, "periapsis": -0.6})
LAP = 2.0 * np.pi * np.sqrt(FRAME.semi_major_axis**3 / MU)  # s

CIRCLE = Orbit(semi_major_axis=6.9e6)
RATE = np.sqrt(MU / CIRCLE.semi_major_axis**3)  # rad/s
PERIOD = float(2.0 * np.pi / RATE)  # s
BESIDE = np.array([100.0, 0.0, 50.0])  # m: up, along, across
DRIFTS = np.array([0.0, -0.1, 0.05])  # m/s


def state(orbit: Orbit) -> tuple[Array, Array]:
    """Return the place [m] and velocity [m/s], inertial axes, at time zero: each (3,)."""
    e, anomaly = orbit.eccentricity, orbit.true_anomaly
    p = orbit.semi_major_axis * (1.0 - e * e)
    out = np.array([np.cos(anomaly), np.sin(anomaly), 0.0])
    place = p / (1.0 + e * out[0]) * out
    velocity = np.sqrt(MU / p) * np.array([-out[1], e + out[0], 0.0])
    turns = [[0, 0, orbit.ascending_node], [orbit.inclination, 0, 0], [0, 0, orbit.periapsis]]
    for turn in reversed(turns):
        q = attitude.from_rotation_vector(np.array(turn))
        place, velocity = attitude.rotate(q, place), attitude.rotate(q, velocity)
    return place, velocity


def coast(place: Array, velocity: Array, time: Array) -> tuple[Array, Array]:
    """Return places [m] and velocities [m/s], each (n, 3), at ``time`` (n,) after a state (3,).

    Kepler's equation in the difference of eccentric anomalies, and Lagrange's coefficients; Battin
    1999, Mathematics and Methods of Astrodynamics, section 4.3.
    """
    r0 = np.linalg.norm(place)
    a = 1.0 / (2.0 / r0 - velocity @ velocity / MU)
    n = np.sqrt(MU / a**3)
    cosine, sine = 1.0 - r0 / a, place @ velocity / np.sqrt(MU * a)  # e times those of E0
    x = n * time
    for _ in range(20):  # Newton's iteration; ten are enough at e = 0.2
        miss = x - cosine * np.sin(x) + sine * (1.0 - np.cos(x)) - n * time
        x = x - miss / (1.0 - cosine * np.cos(x) + sine * np.sin(x))
    c, s = np.cos(x), np.sin(x)
    r = a * (1.0 - cosine * c + sine * s)
    on_place = np.stack([1.0 - a / r0 * (1.0 - c), -n * a * a / (r * r0) * s])
    on_velocity = np.stack([(r0 * s + a * sine * (1.0 - c)) / (n * a), 1.0 - a / r * (1.0 - c)])
    places, velocities = on_place[..., None] * place + on_velocity[..., None] * velocity
    return places, velocities


def hill(beside: Array, drifts: Array, time: Array) -> Array:
    """Return positions (n, 3) [m], up, along, across, from ``beside`` [m] and ``drifts`` [m/s].

    Clohessy and Wiltshire, Terminal guidance system for satellite rendezvous, 1960.
    """
    x, y, z = beside
    u, v, w = drifts / RATE
    angle = RATE * time
    c, s = np.cos(angle), np.sin(angle)
    return np.stack(
        [
            4.0 * x + 2.0 * v - (3.0 * x + 2.0 * v) * c + u * s,
            y - 2.0 * u - 3.0 * (2.0 * x + v) * angle + 2.0 * u * c + (6.0 * x + 4.0 * v) * s,
            z * c + w * s,
        ],
        axis=-1,
    )


def fly_kepler(conditions: Conditions) -> Readings:
    """Fly a body on one ellipse, in a frame that falls along another."""
    outside = Environment(orbit=FRAME)
    model = stand.build(conditions, "orbiter", outside=outside)
    data = stand.start(model, outside)
    frame, body = state(FRAME), state(BODY)
    data.qpos[:3], data.qvel[:3] = body[0] - frame[0], body[1] - frame[1]
    record = stand.fly(conditions, model, data, (0.5 if conditions.short else 2.0) * LAP)
    origin, drift = coast(*frame, record.time)
    exact = coast(*body, record.time)[0] - origin
    off = np.linalg.norm(record.qpos[:, :3] - exact, axis=1)
    place, velocity = origin + record.qpos[:, :3], drift + record.qvel[:, :3]
    energy = 0.5 * np.sum(velocity**2, axis=1) - MU / np.linalg.norm(place, axis=1)
    return Readings(
        values={
            "position": off.max(),
            "energy": meter.drift(energy),
            "momentum": meter.drift(np.cross(place, velocity)),
        },
        motion=Picture.of(
            "place in the frame [km]", record.time, "x y z", exact / 1e3, record.qpos[:, :3] / 1e3
        ),
        error=Curve("position error [m]", record.time, off),
    )


def fly_hill(conditions: Conditions) -> Readings:
    """Let a body drift near a circular orbit: from a far and a near offset, of both signs."""
    outside = Environment(orbit=CIRCLE)
    model = stand.build(conditions, "orbiter", outside=outside)
    frame = state(CIRCLE)
    sign = -1.0 if conditions.fault == "sign" else 1.0
    flown, off = [], []
    for scale in (1.0, -1.0, 0.1, -0.1):
        place = scale * BESIDE
        carried = RATE * np.array([-place[1], place[0], 0.0])
        data = stand.start(model, outside)
        data.qpos[:3], data.qvel[:3] = place, scale * DRIFTS + sign * carried
        record = stand.fly(conditions, model, data, PERIOD)
        velocity = frame[1] + scale * DRIFTS + carried
        exact = coast(frame[0] + place, velocity, record.time)[0] - coast(*frame, record.time)[0]
        off.append(np.linalg.norm(record.qpos[:, :3] - exact, axis=1))
        flown.append(_in_orbit_axes(record.time, record.qpos[:, :3]))
    far, back, near, near_back = flown
    time, exact = record.time, hill(BESIDE, DRIFTS, record.time)
    # the part odd in the offset is Hill's, to third order; the even part is of second order
    linear = 5.0 * (near - near_back)
    return Readings(
        values={
            "position": np.max(off),
            "Hill's part": np.abs(linear - exact).max() / 10.0,
            "drift": linear[-1, 1],
            "second order": np.abs(far + back).max() / np.abs(near + near_back).max(),
        },
        motion=Picture(
            "along the orbit [m]",
            "up [m]",
            (
                Curve("Clohessy-Wiltshire", exact[:, 1], exact[:, 0]),
                Curve("MuJoCo", far[:, 1], far[:, 0], dots=True),
            ),
        ),
        error=Curve("position error [m]", time, off[0]),
    )


def _in_orbit_axes(time: Array, place: Array) -> Array:
    """Return places (n, 3) of inertial axes in those of the circle: up, along, across."""
    turn = attitude.from_rotation_vector(-RATE * np.outer(time, [0.0, 0.0, 1.0]))
    return attitude.rotate(turn, place)


BENCHMARKS = (
    Benchmark(
        name="kepler",
        title="A body on one ellipse, in the frame of another",
        shows=(
            "In the free-fall frame a body thousands of kilometres away stays on Kepler's ellipse "
            "to 15 micrometres over two orbits, since its gravity is evaluated in every stage."
        ),
        source="Kepler's equation; Battin, Mathematics and Methods of Astrodynamics, 1999, ch. 4",
        step=1.0,
        bounds=(
            Bound(
                "position",
                "m",
                2e-4,
                "1 s is 1/1200 rad of the orbit, 1/800 at its lowest: n t (2 n h)^4 / 120 of "
                "8500 km is 6e-6; 1.4e-5 measured",
            ),
            Bound("energy", "of its start", 1e-12, "1e-13 measured"),
            Bound("momentum", "of its start", 1e-12, "5e-14 measured"),
        ),
        fly=fly_kepler,
        catches={"integrator": "", "held": ""},
        order=Order(("position",), (40.0, 20.0, 10.0)),
    ),
    Benchmark(
        name="hill",
        title="Drift beside a circular orbit (Clohessy-Wiltshire)",
        shows=(
            "Two neighbouring bodies in orbit drift apart by 2 km a revolution as Hill's equations "
            "predict, plus the 0.3 m of their exact ellipses."
        ),
        source=(
            "Clohessy and Wiltshire, Terminal guidance system for satellite rendezvous, 1960; the "
            "drift in one orbit is -(12 pi x0 + 6 pi v0 / n)"
        ),
        step=PERIOD / 2280,
        bounds=(
            Bound(
                "position",
                "m",
                3e-7,
                "against the difference of two ellipses, good to some 1e-15 of 6900 km; RK4's "
                "n t (n h)^4 / 120 of 2 km is 4e-9; 3e-8 measured",
            ),
            Bound(
                "Hill's part",
                "m",
                3e-7,
                "the part odd in an offset of 10 m, third order included: 3e-8 measured",
            ),
            Bound(
                "drift",
                "m in an orbit",
                3e-6,
                "as Hill's part, made ten times larger",
                float(hill(BESIDE, DRIFTS, np.array([PERIOD]))[0, 1]),
            ),
            Bound(
                "second order",
                "times",
                1e-5,
                "the even part shrinks 100 times with a tenth of the offset; 6e-7 measured",
                100.0,
            ),
        ),
        fly=fly_hill,
        catches={
            "sign": "the turning of the orbit's axes taken off the release's velocity, not added",
            "integrator": "",
            "held": "",
        },
        order=Order(("position",), (PERIOD / 285, PERIOD / 570, PERIOD / 1140)),
    ),
)
