"""An axisymmetric body without torque: precession at constant rates, undamped nutation."""

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

TRANSVERSE, AXIAL = 10.0, 14.0  # kg m^2, about x and y, and about z
RATE = np.array([0.2, 0.0, 1.0])  # rad/s, at the start


def exact(time: Array) -> tuple[Array, Array]:
    """Return rates (n, 3) [rad/s] and attitudes (n, 4) at ``time`` (n,), from the identity at 0.

    The body precesses about its momentum at L / It, and nutates about its own axis. Landau and
    Lifshitz, Mechanics, section 33, where the angles are Euler's.
    """
    momentum = np.array([TRANSVERSE, TRANSVERSE, AXIAL]) * RATE
    nutation = (AXIAL / TRANSVERSE - 1.0) * RATE[2] * time[:, None] * np.array([0.0, 0.0, 1.0])
    precession = time[:, None] * momentum / TRANSVERSE
    rates = attitude.rotate(attitude.from_rotation_vector(nutation), RATE)
    attitudes = attitude.multiply(
        attitude.from_rotation_vector(precession), attitude.from_rotation_vector(-nutation)
    )
    return rates, attitudes


def nutate(conditions: Conditions) -> Readings:
    """Fly the body for a minute and compare it with the closed form."""

    def axisymmetric(spec: Any) -> None:
        spec.body("bus").inertia = TRANSVERSE, TRANSVERSE, AXIAL

    model = stand.build(conditions, "tumbler", adapt=axisymmetric)
    data = stand.start(model)
    data.qvel[3:6] = RATE
    record = stand.fly(conditions, model, data, 20.0 if conditions.short else 60.0)
    flown = record.qvel[:, 3:6]
    rates, attitudes = exact(record.time)
    off = attitude.rotation_angle(record.qpos[:, 3:7], attitudes)
    growth = np.polyfit(record.time, np.log(np.hypot(flown[:, 0], flown[:, 1])), 1)[0]
    return Readings(
        values={
            "attitude": off.max(),
            "rate": np.abs(flown - rates).max(),
            "growth of nutation": float(growth),
            "momentum": meter.drift(meter.angular_momentum(record)),
            "energy": meter.drift(meter.kinetic_energy(record)),
        },
        motion=Picture.of("rate [rad/s]", record.time, "w1 w2 w3", rates, flown),
        error=Curve("attitude error [rad]", record.time, off),
    )


BENCHMARKS = (
    Benchmark(
        name="nutation",
        title="Nutation of an axisymmetric body",
        shows=(
            "RK4 keeps the amplitude of nutation. At a nutation frequency l and a step h, Euler "
            "and, with jointed bodies, implicitfast make it grow at the rate l^2 h / 2, and "
            "implicit damps it as fast: this would be confused with the effect of a damper."
        ),
        source="Euler's equations; Landau and Lifshitz, Mechanics, section 33",
        step=0.01,
        bounds=(
            Bound(
                "attitude",
                "rad",
                5e-9,
                "RK4's phase error l t (l h)^4 / 120 of the nutation is 5e-11; 9e-12 measured",
            ),
            Bound("rate", "rad/s", 1e-10, "that phase error times 0.2 rad/s is 1e-11, as measured"),
            Bound(
                "growth of nutation",
                "1/s",
                3e-14,
                "RK4's own is -l^6 h^5 / 144 = -2.8e-15, and is measured; Euler's is 8e-4",
            ),
            Bound(
                "momentum", "of the bus", 3e-10, "as the attitude, which turns it; 3e-12 measured"
            ),
            Bound("energy", "of the bus", 1e-12, "1e-14 measured: 6000 roundings"),
        ),
        fly=nutate,
        catches={"integrator": "", "armature": "", "inertia": ""},
        order=Order(("attitude", "rate"), (0.32, 0.16, 0.08)),
    ),
)
