"""Flat spin: a body that spins about its minor axis and dissipates ends about its major axis."""

import numpy as np

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
from mjspace.validation.benchmarks.dampers import Ring, nutation

RING = Ring((12.0, 12.5, 8.0), axial=1.8, damping=1.08)  # six times the part, for a fast transition
INERTIA = np.array(RING.whole)  # kg m^2
RATE = np.array([0.02, 0.0, 2.0])  # rad/s: the momentum is 0.86 degrees off the minor axis
DURATION, HALFWAY = 200, 66  # s, sampled every second

MOMENTUM = INERTIA * RATE
FLAT_RATE = float(np.linalg.norm(MOMENTUM) / INERTIA.max())  # rad/s
ENERGY_LOSS = float(1.0 - INERTIA.max() * FLAT_RATE**2 / (INERTIA @ RATE**2))
"""Without the nutation at the start it is 1 - Imin / Imax."""


def fall_over(conditions: Conditions) -> Readings:
    """Fly from one spin to the other; a short flight completes the transition, too."""
    model = stand.build(conditions, RING.model, adapt=RING.adapt)
    data = stand.start(model)
    data.qvel[3:6] = RATE
    record = stand.fly(conditions, model, data, DURATION, samples=DURATION)
    angle = nutation(MOMENTUM, record.qpos[:, 3:7])
    momentum, energy = meter.angular_momentum(record), meter.kinetic_energy(record)
    off = np.linalg.norm(momentum - momentum[0], axis=1) / np.linalg.norm(momentum[0])
    return Readings(
        values={
            "angle halfway": float(angle[HALFWAY]),
            "angle": float(angle[-1]),
            "rate": float(np.linalg.norm(record.qvel[-1, 3:6])),
            "energy loss": float(1.0 - energy[-1] / energy[0]),
            "energy gain": float(np.diff(energy).max() / energy[0]),
            "momentum": float(off.max()),
        },
        motion=Picture(
            "time [s]",
            "momentum [rad], energy [of the start]",
            (
                Curve("angle of the momentum to the minor axis", record.time, angle),
                Curve("energy", record.time, energy / energy[0]),
            ),
        ),
        error=Curve("momentum error [relative]", record.time, off),
    )


BENCHMARKS = (
    Benchmark(
        name="flat-spin",
        title="Flat spin, as of Explorer 1",
        shows=(
            "A body that loses energy but no momentum changes its spin from minor to major axis, "
            "and its final state follows from momentum alone. Other integrators end there, too, "
            "but with an error of 2 % of the momentum."
        ),
        source=(
            "Hughes, Spacecraft Attitude Dynamics, 1986, chapter 5; "
            "classic closed form, H = Imax w at the end"
        ),
        step=0.01,
        bounds=(
            Bound(
                "angle halfway",
                "rad",
                3e-9,
                "at 66 s, where a rate off by 1e-9 would show as 1e-9 rad; 2e-10 measured",
                0.799032625113,
            ),
            Bound("angle", "rad", 1e-9, "7e-11 measured, the nutation that is left", np.pi / 2.0),
            Bound("rate", "rad/s", 1e-10, "as the momentum; 8e-12 measured", FLAT_RATE),
            Bound("energy loss", "of all", 1e-10, "as the momentum; 8e-12 measured", ENERGY_LOSS),
            Bound("energy gain", "of all", 1e-12, "never; 6e-15 measured, rounding"),
            Bound("momentum", "of all", 3e-10, "9e-11 measured, most of it in the fall"),
        ),
        fly=fall_over,
        catches={"integrator": "", "armature": "", "inertia": ""},
        order=Order(("momentum",), (0.1, 0.05, 0.025)),
    ),
)
