"""A lander dropped onto the Moon: its legs compress, it comes to rest and does not creep."""

from typing import Any

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.validation import meter, stand
from mjspace.validation.benchmark import Benchmark, Bound, Conditions, Curve, Picture, Readings

GRAVITY = 1.62  # m/s^2, the Moon's
MASS = 100.0  # kg, balanced about the origin when the legs are out
FOOT = 0.75  # kg, each of four
STIFFNESS = 2500.0  # N/m, each
DAMPING = 400.0  # N s/m, each
FEET = np.array([[1.3, 0, 0], [0, 1.3, 0], [-1.3, 0, 0], [0, -1.3, 0]])  # m
STANCE = 1.8  # m from the soles to the origin
SOLE = 0.06  # m, radius of the ball under each foot
DROP = 0.1  # m
SLOPE = np.radians(3.0)

TOUCHDOWN = np.sqrt(2.0 * DROP / GRAVITY)  # s


def exact_height(time: Array) -> Array:
    """Return the hull's height above its stance [m]: a fall, then a damped oscillation.

    The feet stop at once on rigid ground; the hull moves as a mass on four springs and dampers,
    M x'' + 4 c x' + 4 k x = M g with x downwards.
    """
    hull, stiffness = MASS - 4.0 * FOOT, 4.0 * STIFFNESS
    decay = 2.0 * DAMPING / hull
    pace = np.sqrt(stiffness / hull - decay**2)
    rest = hull * GRAVITY / stiffness
    since = np.maximum(time - TOUCHDOWN, 0.0)
    speed = GRAVITY * TOUCHDOWN
    swing = -rest * np.cos(pace * since) + (speed - decay * rest) / pace * np.sin(pace * since)
    sunk = rest + np.exp(-decay * since) * swing
    return np.where(time < TOUCHDOWN, DROP - 0.5 * GRAVITY * time**2, -sunk)


def level(conditions: Conditions) -> Readings:
    """Drop onto level ground."""
    record, force = _drop(conditions, 0.0, 2.5, samples=500)
    height = record.qpos[:, 2] - STANCE
    exact = exact_height(record.time)
    off = np.abs(height - exact)
    return Readings(
        values={
            "fall": off[record.time < TOUCHDOWN].max(),
            "heave": off.max(),
            **_judged(record, force, _energy(record), 0.0),
        },
        motion=Picture.of("height [m]", record.time, "z", exact[:, None], height[:, None]),
        error=Curve("height error [m]", record.time, off),
    )


def slope(conditions: Conditions) -> Readings:
    """Drop onto a slope: one foot touches first, and the lander rocks until all four do."""
    record, force = _drop(conditions, SLOPE, 7.0, samples=350)
    energy = _energy(record)
    legs = [Curve(f"leg {leg}", record.time, record.qpos[:, 7 + leg]) for leg in range(len(FEET))]
    return Readings(
        values=_judged(record, force, energy, SLOPE),
        motion=Picture("time [s]", "strut [m]", tuple(legs)),
        error=Curve("energy above rest [J]", record.time, energy - energy[-1]),
    )


def _drop(
    conditions: Conditions, tilt: float, duration: float, samples: int
) -> tuple[stand.Record, Array]:
    """Return the flight and the ground's force [N] at its end, world axes."""

    def adapt(spec: Any) -> None:
        spec.geom("ground").quat = attitude.from_rotation_vector(np.array([0.0, tilt, 0.0]))
        if conditions.fault == "erratum":
            spec.option.cone, spec.option.impratio = 0, 1.0
            for leg in range(len(FEET)):
                spec.geom(f"leg_{leg}_pad").priority = 0

    def read(model: Any, data: Any, time: float) -> None:
        # The constraint force on the free joint's translation is the ground's.
        force[:] = data.qfrc_constraint[:3]

    model = stand.build(conditions, "lander", adapt=adapt)
    if conditions.fault == "sign":
        model.jnt_stiffness[1:] *= -1.0
    data = stand.start(model)
    data.qpos[2] += DROP + (FEET[0, 0] + SOLE) * np.tan(tilt)
    force = np.zeros(3)
    record = stand.fly(conditions, model, data, duration, before_step=read, samples=samples)
    return record, force


def _energy(record: stand.Record) -> Array:
    """Return kinetic, potential and spring energy together [J]; the ground's is not in it."""
    struts = record.qpos[:, 7:11]
    up = attitude.rotate(record.qpos[:, 3:7], np.array([0.0, 0.0, 1.0]))[:, 2]
    moment = MASS * record.qpos[:, 2] + FOOT * up * struts.sum(axis=1)
    stored = 0.5 * STIFFNESS * np.sum(struts**2, axis=1)
    return np.asarray(meter.kinetic_energy(record) + GRAVITY * moment + stored)


def _judged(record: stand.Record, force: Array, energy: Array, tilt: float) -> dict[str, float]:
    normal = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    struts = record.qpos[:, 7:11, None] * np.array([0.0, 0.0, 1.0])
    balls = FEET + struts + np.array([0.0, 0.0, SOLE - STANCE])
    places = record.qpos[:, None, :3] + attitude.rotate(record.qpos[:, None, 3:7], balls)
    weight = np.array([0.0, 0.0, MASS * GRAVITY])
    return {
        "gain": float((energy - np.minimum.accumulate(energy)).max()),
        "sink": float((SOLE - places @ normal).max()),
        "rest force": float(np.linalg.norm(force - weight) / weight[2]),
        "creep": float(np.linalg.norm(record.qvel[-1, :3])),
    }


DEFAULTS = "the pads' contact averaged with MuJoCo's default, and the default friction cone"

BENCHMARKS = (
    Benchmark(
        name="lander-contact",
        title="Lander dropped onto level ground",
        shows=(
            "The legs act as springs and dampers, the ground returns no energy, and finally it "
            "carries the weight. With the other integrators touchdown is half a millimetre early "
            "and the impact gains 0.08 J, but the final rest is the same."
        ),
        source="classic closed form, derived here: a fall, then a mass on springs and dampers",
        step=0.002,  # the dampers on the feet alone, 533 /s, bear 5 ms at most with RK4
        bounds=(
            Bound("fall", "m", 1e-12, "a parabola, exact for RK4; 2e-16 measured"),
            Bound("heave", "m", 5e-4, "soft ground, rigid in the solution; 1.5e-4 measured"),
            Bound("gain", "J", 1e-3, "of 17 J lost, stored in the ground; 4e-5 measured"),
            Bound("sink", "m", 2e-3, "0.57 m/s stopped within 4 ms; 9e-4 measured"),
            Bound("rest force", "of the weight", 1e-6, "exp(-8.2 t) of the heave; 7e-8 measured"),
            Bound("creep", "m/s", 1e-7, "as the rest force; 9e-9 measured"),
        ),
        fly=level,
        catches={
            "sign": "the struts' springs pull where they should push",
            "erratum": DEFAULTS,
            "integrator": "",
        },
    ),
    Benchmark(
        name="lander-slope",
        title="Lander dropped onto a slope",
        shows=(
            "It touches with one foot, rocks and comes to rest; its energy never rises. MuJoCo's "
            "contacts and friction are soft: with the defaults the lander creeps downhill at 0.7 "
            "mm/s without end. The other integrators come to the same rest."
        ),
        source="energy and equilibrium: at rest the ground's force is the weight, reversed",
        step=0.002,  # as on level ground
        bounds=(
            Bound("gain", "J", 1e-3, "as on level ground; 1e-13 measured"),
            Bound("sink", "m", 2e-3, "as on level ground; 7e-4 measured"),
            Bound("rest force", "of the weight", 1e-3, "of rocking, exp(-1.6 t); 2e-5 measured"),
            Bound("creep", "m/s", 1e-4, "of rocking and of soft friction; 8e-6 measured"),
        ),
        fly=slope,
        catches={"erratum": DEFAULTS, "integrator": ""},
    ),
)
