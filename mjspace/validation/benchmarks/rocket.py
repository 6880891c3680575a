"""A rocket that burns its own mass: Tsiolkovsky's equation, and the damping by its jet."""

from typing import Any

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
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

MASS = 1000.0  # kg at ignition
DRY = 700.0  # kg
THRUST = 400.0  # N
EXHAUST = 300.0 * 9.80665  # m/s, of 300 s specific impulse
FLOW = THRUST / EXHAUST  # kg/s
BURN = (MASS - DRY) / FLOW  # s, 2206.5
GYRATION = 1.0  # m, across the thrust; does not change
LEVER = 1.5  # m from the centre of mass to the nozzle's exit
PITCH = 0.1  # rad/s at ignition


def mass(time: Array) -> Array:
    """Return the remaining mass [kg]."""
    return MASS - FLOW * time


def exact_flight(time: Array) -> tuple[Array, Array]:
    """Return speed [m/s] and distance [m] from rest, in a straight line."""
    logarithm = np.log(MASS / mass(time))
    return EXHAUST * logarithm, EXHAUST * (time - mass(time) / FLOW * logarithm)


def exact_pitch(time: Array) -> tuple[Array, Array]:
    """Return rate [rad/s] and angle [rad] across the thrust: w / w0 = (m / m0)^(re^2/kg^2 - 1).

    What leaves at the exit carries w re^2 of angular momentum a kilogram away, and w kg^2 of it was
    its own share of the body's.
    """
    power = (LEVER / GYRATION) ** 2 - 1.0
    left = mass(time) / MASS
    swept = PITCH * MASS / FLOW * (1.0 - left ** (power + 1.0)) / (power + 1.0)
    return PITCH * left**power, swept


def burn(conditions: Conditions) -> Readings:
    """Burn straight ahead from rest."""

    def thrust(model: Any, data: Any, time: float) -> Array:
        # The model has the mass of the step's start; the ratio corrects it to that of the stage.
        force[0] = THRUST * model.body_mass[1] / (MASS - FLOW * time)
        return force

    force = np.zeros(6)
    record = _fly(conditions, np.zeros(3), thrust)
    speed, distance = exact_flight(record.time)
    off = np.abs(record.qvel[:, 0] - speed)
    return Readings(
        values={
            "speed": off.max(),
            "distance": np.abs(record.qpos[:, 0] - distance).max(),
        },
        motion=Picture.of("speed [m/s]", record.time, "v", speed[:, None], record.qvel[:, :1]),
        error=Curve("speed error [m/s]", record.time, off),
    )


def pitch(conditions: Conditions) -> Readings:
    """Burn while pitching: the jet damps the rate."""
    sign = -1.0 if conditions.fault == "sign" else 1.0
    gain = sign * FLOW * (LEVER**2 - GYRATION**2)

    def jet(model: Any, data: Any, time: float) -> Array:
        force[4] = -gain * data.qvel[4] * model.body_mass[1] / (MASS - FLOW * time)
        return force

    force = np.zeros(6)
    record = _fly(conditions, np.array([0.0, PITCH, 0.0]), jet)
    rate, angle = exact_pitch(record.time)
    exact = attitude.from_rotation_vector(angle[:, None] * np.array([0.0, 1.0, 0.0]))
    off = attitude.rotation_angle(record.qpos[:, 3:7], exact)
    return Readings(
        values={"attitude": off.max(), "rate": np.abs(record.qvel[:, 4] - rate).max()},
        motion=Picture.of("rate [rad/s]", record.time, "w2", rate[:, None], record.qvel[:, 4:5]),
        error=Curve("attitude error [rad]", record.time, off),
    )


def _fly(conditions: Conditions, rate: Array, load: stand.Load) -> stand.Record:
    """Burn, with mass and inertia written into the model before every step.

    MuJoCo works a lone free body's mass out once, when it is compiled or by ``mj_setConst``; edits
    of ``body_mass`` in between reach its motion only if the model says ``simple="false"``.
    """

    def adapt(spec: Any) -> None:
        spec.body("bus").simple = conditions.fault == "erratum"

    model = stand.build(conditions, "stage", adapt=adapt)
    full = model.body_inertia[1].copy()

    def deplete(model: Any, data: Any, time: float) -> None:
        left = 1.0 - FLOW * time / MASS
        model.body_mass[1] = MASS * left
        model.body_inertia[1] = full * left

    data = stand.start(model)
    data.qvel[3:6] = rate
    return stand.fly(conditions, model, data, BURN, load=load, before_step=deplete)


BENCHMARKS = (
    Benchmark(
        name="rocket",
        title="Rocket that burns 30 % of its mass",
        shows=(
            "Mass that burns away, written into the model before every step and corrected at every "
            'stage, keeps RK4\'s fourth order. A lone body must say simple="false", or MuJoCo '
            "flies on with the mass it was compiled with: 16 % too slow, and no warning."
        ),
        source="Tsiolkovsky's rocket equation, 1903, and its integral over time",
        step=1.0,  # nothing is faster than the burn, which lasts 37 minutes
        bounds=(
            Bound("speed", "m/s", 3e-11, "2206 roundings of 1049 m/s; 3e-12 measured"),
            Bound("distance", "m", 3e-8, "2206 roundings of 1089 km; 3.4e-9 measured"),
        ),
        fly=burn,
        catches={
            "erratum": "the body left simple, so that edits of its mass have no effect",
            "integrator": "",
            "held": "",
        },
        order=Order(("speed", "distance"), (128.0, 64.0, 32.0)),
    ),
    Benchmark(
        name="jet-damping",
        title="Jet damping of a pitching rocket",
        shows=(
            "MuJoCo keeps a body's rate when its inertia is edited, as if the expelled mass took "
            "its own share of the momentum along. The additional momentum of the jet has to be "
            "added as a torque; with it the rate falls to 64 %, as it should."
        ),
        source="classic closed form, derived here: d(m kg^2 w)/dt = m' re^2 w",
        step=1.0,  # the one time scale is the burn's
        bounds=(
            Bound("attitude", "rad", 5e-9, "of 180 rad turned; 1e-13 measured"),
            Bound("rate", "rad/s", 1e-13, "as exact as doubles; 2e-16 measured"),
        ),
        fly=pitch,
        catches={
            "sign": "the jet's torque drives the rate",
            "erratum": "the body left simple, so that edits of its inertia have no effect",
            "armature": "",
            "integrator": "",
            "held": "",
            "inertia": "",
        },
        order=Order(("attitude", "rate"), (128.0, 64.0, 32.0)),
    ),
)
