"""Dual spin: a spinning bus with a wheel on its axis, stable or not."""

import numpy as np

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

AXIAL = 0.01  # kg m^2, of the wheel, about z
BUS = np.array([10.006, 12.006, 14.0])  # kg m^2, with the wheel's transverse inertia of 0.006

STABLE = (0.05, 6.0)  # spin [rad/s] about z, the wheel's momentum [N m s]
UNSTABLE = (0.5, -1.5)
NUDGE = 2e-6  # rad/s, about x: small enough for linear equations, large beside rounding


def stiffness(inertia: Array, spin: float, momentum: float) -> tuple[float, float]:
    """Return k1, k2 [N m s] of I1 w1' = -k2 w2 and I2 w2' = k1 w1: small rates beside ``spin``.

    ``inertia`` (3,) is without the wheel's axial part, ``momentum`` is Jw (Omega + spin).  The
    nutation frequency's square is k1 k2 / (I1 I2); less than 0, it is that of a growth rate.
    Hughes, Spacecraft Attitude Dynamics, 1986, chapter 6.
    """
    k1 = (inertia[2] - inertia[0]) * spin + momentum
    k2 = (inertia[2] - inertia[1]) * spin + momentum
    return float(k1), float(k2)


def dual_spin(conditions: Conditions) -> Readings:
    """Perturb a spinning bus that its wheel stabilizes, and one that its wheel destabilizes."""

    def nudged(spin: float, momentum: float) -> tuple[stand.Record, Array, float, float]:
        model = stand.build(conditions, "bus_wheel")
        data = stand.start(model)
        data.qvel[3:6] = NUDGE, 0.0, spin
        data.qvel[6] = (-momentum if conditions.fault == "sign" else momentum) / AXIAL - spin
        record = stand.fly(conditions, model, data, 30.0 if conditions.short else 60.0)
        return record, record.qvel[:, 3:5].T, *stiffness(BUS, spin, momentum)

    record, (w1, w2), k1, k2 = nudged(*STABLE)
    time, end = record.time, record.time[-1]
    I1, I2, I3 = BUS
    frequency = np.sqrt(k1 * k2 / (I1 * I2))
    nutating = np.sqrt(I1 * k1) * w1 + 1j * np.sqrt(I2 * k2) * w2  # turns at the frequency
    phase = np.unwrap(np.angle(nutating))
    stable = np.cos(frequency * time), w1 / NUDGE

    other, (w1, w2), k1, k2 = nudged(*UNSTABLE)
    rate = np.sqrt(-k1 * k2 / (I1 * I2))
    growing = w1 + rate * I2 / k1 * w2  # the growing mode alone
    unstable = np.cosh(rate * time), w1 / NUDGE
    return Readings(
        values={
            "nutation frequency": abs(phase[-1] / end - frequency),
            "nutation growth": np.log(abs(nutating[-1] / nutating[0])) / end,
            "divergence": abs(np.log(abs(growing[-1] / growing[0])) / end - rate),
            "momentum": max(
                meter.drift(meter.angular_momentum(flight), scale=I3 * spin)
                for flight, (spin, _) in ((record, STABLE), (other, UNSTABLE))
            ),
        },
        motion=Picture.of(
            "w1, of the nudge", time, "stable unstable", *np.stack([stable, unstable], axis=2)
        ),
        error=Curve("nutation phase error [rad]", time, np.abs(phase - frequency * time)),
    )


BENCHMARKS = (
    Benchmark(
        name="dual-spin",
        title="Stability of dual spin",
        shows=(
            "A wheel decides whether a spin is stable, and MuJoCo's RK4 has the nutation frequency "
            "and the rate of divergence to ten digits. Euler lets a stable bus diverge."
        ),
        source=(
            "Linear gyrostat equations; Hughes, Spacecraft Attitude Dynamics, 1986, chapter 6; "
            "closed form, derived here"
        ),
        step=0.01,
        bounds=(
            Bound("nutation frequency", "rad/s", 5e-11, "l (l h)^4 / 120 = 4.5e-12, as measured"),
            Bound("nutation growth", "1/s", 1e-12, "l^6 h^5 / 144 = 2e-14, as measured"),
            Bound(
                "divergence",
                "1/s",
                1e-10,
                "terms beyond the linear equations, (nudge e^2.7 / spin)^2; 6e-12 measured",
            ),
            Bound("momentum", "of the bus", 1e-12, "rounding; 5e-14 measured"),
        ),
        fly=dual_spin,
        catches={"sign": "the wheel turned the other way", "integrator": "", "inertia": ""},
        order=Order(("nutation frequency",), (0.32, 0.16, 0.08)),
    ),
)
