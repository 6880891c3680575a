"""A body without torque: tumble in elliptic functions, and flip about the middle axis."""

from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.special import ellipj, ellipkinc

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

TUMBLER = np.array([10.0, 12.0, 14.0])  # kg m^2
TUMBLE = np.array([0.3, 0.1, 0.5])  # rad/s
SPINNER = np.array([1.0, 2.0, 2.9])  # kg m^2
SPIN = np.array([1e-3, 2.0, 0.0])  # rad/s
FLIP_INTERVAL = 16.0839842523  # s, 2 K(m) / p of the spinner; two routes agree to 3e-10


def exact_tumble(time: Array) -> tuple[Array, Array]:
    """Return rates (n, 3) [rad/s] and attitudes (n, 4) of the tumbler at ``time`` (n,) from 0.

    Jacobi's solution where L^2 > 2 T I2 and w3 > 0; Landau and Lifshitz, Mechanics, section 37. The
    angle of precession is the one quadrature, Gauss-Legendre between the times.
    """
    I1, I2, I3 = TUMBLER
    momentum = np.linalg.norm(TUMBLER * TUMBLE)
    squares = momentum**2 - TUMBLER * (TUMBLER @ TUMBLE**2)  # L^2 - 2 T I, without cancellation
    size = np.sqrt(
        [
            -squares[2] / (I1 * (I3 - I1)),
            -squares[2] / (I2 * (I3 - I2)),
            squares[0] / (I3 * (I3 - I1)),
        ]
    )
    pace = np.sqrt((I3 - I2) * squares[0] / (I1 * I2 * I3))
    m = (I2 - I1) * -squares[2] / ((I3 - I2) * squares[0])
    begin = ellipkinc(np.arctan2(TUMBLE[1] / size[1], TUMBLE[0] / size[0]), m)

    def rates(at: Array) -> Array:
        sn, cn, dn, _ = ellipj(pace * at + begin, m)
        return np.asarray(size * np.stack([cn, sn, dn], axis=-1))

    def precession_rate(at: Array) -> Array:
        p = (TUMBLER * rates(at))[..., :2]
        return np.asarray(momentum * np.sum(p**2 / TUMBLER[:2], -1) / np.sum(p**2, -1))

    nodes, weights = np.polynomial.legendre.leggauss(20)
    half = np.diff(time) / 2.0
    inside = (time[:-1] + half)[:, None] + half[:, None] * nodes
    precession = np.concatenate([[0.0], np.cumsum(half * (precession_rate(inside) @ weights))])

    spin = rates(time)
    towards = TUMBLER * spin / momentum  # the unit momentum in body axes
    nutation = np.arccos(towards[:, 2])
    q = attitude.multiply(
        _about(2, precession),
        attitude.multiply(_about(0, nutation), _about(2, np.arctan2(towards[:, 0], towards[:, 1]))),
    )
    return spin, attitude.multiply(attitude.conjugate(q[0]), q)


def tumble(conditions: Conditions) -> Readings:
    """Fly the tumbler for a minute and compare it with Jacobi's solution."""
    model = stand.build(conditions, "tumbler")
    data = stand.start(model)
    data.qvel[3:6] = TUMBLE
    record = stand.fly(conditions, model, data, 20.0 if conditions.short else 60.0)
    rates, attitudes = exact_tumble(record.time)
    off = attitude.rotation_angle(record.qpos[:, 3:7], attitudes)
    return Readings(
        values={
            "attitude": off.max(),
            "rate": np.abs(record.qvel[:, 3:6] - rates).max(),
            "momentum": meter.drift(meter.angular_momentum(record)),
            "energy": meter.drift(meter.kinetic_energy(record)),
        },
        motion=Picture.of("rate [rad/s]", record.time, "w1 w2 w3", rates, record.qvel[:, 3:6]),
        error=Curve("attitude error [rad]", record.time, off),
    )


def flip(conditions: Conditions) -> Readings:
    """Fly the spinner about its middle axis, about which it flips periodically."""

    def slim(spec: Any) -> None:
        spec.body("bus").inertia = SPINNER

    model = stand.build(conditions, "tumbler", adapt=slim)
    data = stand.start(model)
    data.qvel[3:6] = SPIN
    record = stand.fly(conditions, model, data, 65.0, samples=650)
    rates = record.qvel[:, 3:6]
    energy = meter.kinetic_energy(record)
    off = np.abs(energy / energy[0] - 1.0)
    return Readings(
        values={
            "interval": float(np.mean(np.diff(_crossings(record.time, rates)))),
            "momentum": meter.drift(meter.angular_momentum(record)),
            "energy": off.max(),
        },
        motion=Picture(
            "time [s]",
            "rate [rad/s]",
            tuple(Curve(f"w{axis + 1}", record.time, rates[:, axis]) for axis in range(3)),
        ),
        error=Curve("relative energy error", record.time, off),
    )


def _crossings(time: Array, rates: Array) -> Array:
    """Return when the middle rate changes its sign [s], by cubics through rates and slopes."""
    slopes = (SPINNER[2] - SPINNER[0]) * rates[:, 2] * rates[:, 0] / SPINNER[1]
    roots = CubicHermiteSpline(time, rates[:, 1], slopes).roots(extrapolate=False)
    return np.asarray(roots)


def _about(axis: int, angle: Array) -> Array:
    """Return the quaternions (..., 4) of turns by ``angle`` [rad] about a coordinate axis."""
    return attitude.from_rotation_vector(angle[..., None] * np.eye(3)[axis])


BENCHMARKS = (
    Benchmark(
        name="torque-free",
        title="Torque-free tumble of an asymmetric body",
        shows=(
            "MuJoCo's RK4 has attitude, momentum and energy of a tumbling satellite for a minute "
            "at a step of 10 ms nearly to rounding; its other integrators are off by degrees."
        ),
        source="Jacobi's elliptic functions; Landau and Lifshitz, Mechanics, section 37",
        step=0.01,
        bounds=(
            Bound(
                "attitude",
                "rad",
                5e-9,
                "RK4's phase error w t (w h)^4 / 120 is 2e-10; 7e-13 measured",
            ),
            Bound(
                "rate", "rad/s", 1e-10, "4e-14 measured; rounding over 6000 steps may reach 1e-12"
            ),
            Bound(
                "momentum", "of the bus", 3e-10, "as the attitude, which turns it; 9e-13 measured"
            ),
            Bound("energy", "of the bus", 1e-12, "1e-14 measured: 6000 roundings"),
        ),
        fly=tumble,
        catches={"integrator": "", "armature": "", "inertia": ""},
        order=Order(("attitude", "rate"), (0.32, 0.16, 0.08)),
    ),
    Benchmark(
        name="middle-axis",
        title="Flip about the middle axis (Dzhanibekov)",
        shows=(
            "The flip interval alone is no test: Euler has it to 2e-6 with an energy error of 10 "
            "%. Energy and momentum are the test."
        ),
        source="Landau and Lifshitz, Mechanics, section 37: half a period is 2 K(m) / p",
        step=0.01,
        bounds=(
            Bound(
                "interval", "s", 3e-8, "the reference's own digits, 3e-10 relative", FLIP_INTERVAL
            ),
            Bound(
                "momentum", "of the bus", 5e-8, "w t (w h)^4 / 120 = 2e-7 at 2 rad/s; 5e-9 measured"
            ),
            Bound(
                "energy",
                "of the bus",
                2e-10,
                "amplitude error (w h)^6 / 144 a step; 2e-11 measured",
            ),
        ),
        fly=flip,
        catches={"integrator": "", "armature": "", "inertia": ""},
    ),
)
