"""Bodies that the gravity gradient stabilizes upright: the Lagrange and DeBra-Delp regions."""

from typing import Any

import numpy as np
from scipy.linalg import expm

from mjspace import attitude
from mjspace.contract import Array
from mjspace.scenario.environment import Environment
from mjspace.validation import stand
from mjspace.validation.benchmark import (
    Benchmark,
    Bound,
    Conditions,
    Curve,
    Picture,
    Readings,
)
from mjspace.validation.benchmarks.gravity_gradient import ORBIT, RATE, eigenvalues, librate

SHAPES = np.array(
    [  # k1, k3: within a region, then across its nearest border
        *([0.5, 0.4], [0.4, 0.5]),
        *([0.9, 0.8], [0.8, 0.9]),
        *([0.6, 0.05], [0.6, -0.05]),
        *([0.95, 0.05], [0.95, -0.05]),
        *([-0.02, -0.9], [0.02, -0.9]),
        *([-0.04, -0.6], [0.04, -0.6]),
        *([-0.04, -0.9], [-0.10, -0.9]),
        *([-0.06, -0.5], [-0.12, -0.5]),
        *([-0.05, -0.10], [-0.10, -0.05]),
    ]
)
ROLL = 10.0  # kg m^2
SMALL = 1e-7  # rad: second-order terms are 1e-7 of it
GROWS = 0.01  # of the orbital rate: slower growth counts as none
INTERVAL, SAMPLES = 80.0, 70  # s, and how many: 98 % of an orbit


def inertia(k1: float, k3: float) -> Array:
    """Return the inertias about roll, pitch and yaw [kg m^2] of a shape.

    k1 = (pitch - yaw) / roll and k3 = (pitch - roll) / yaw.
    """
    return ROLL * np.array([1.0, (1.0 - k1 * k3) / (1.0 - k3), (1.0 - k1) / (1.0 - k3)])


def stable(k1: float, k3: float) -> bool:
    """Tell whether a shape is in the Lagrange region or in DeBra and Delp's."""
    lagrange = k1 > k3 > 0.0
    debra_delp = k3 < k1 < 0.0 and 1.0 + 3.0 * k1 + k1 * k3 > 4.0 * np.sqrt(k1 * k3)
    return bool(lagrange or debra_delp)


def linear(inertia: Array) -> Array:
    """Return A (6, 6) of x' = A x for small roll, pitch, yaw [rad] and their rates [rad/s].

    Hughes, Spacecraft Attitude Dynamics, 1986, section 9.2.
    """
    I1, I2, I3 = inertia
    k1, k2, k3 = (I2 - I3) / I1, (I1 - I3) / I2, (I2 - I1) / I3
    A = np.zeros((6, 6))
    A[:3, 3:] = np.eye(3)
    A[3, 0], A[3, 5] = -4.0 * RATE**2 * k1, RATE * (1.0 - k1)
    A[4, 1] = -3.0 * RATE**2 * k2
    A[5, 2], A[5, 3] = -(RATE**2) * k3, -RATE * (1.0 - k3)
    return A


def fly(conditions: Conditions) -> Readings:
    """Release each shape near its upright attitude and find which remain there."""
    flown = [_let_go(conditions, inertia(*shape)) for shape in SHAPES]
    growth = np.array([found.real.max() for found, _ in flown]) / RATE
    exact = [np.linalg.eigvals(linear(inertia(*shape))).real.max() / RATE for shape in SHAPES]
    off = np.array([departure for _, departure in flown]).max(axis=0)
    judged = np.array([stable(*shape) for shape in SHAPES])
    return Readings(
        values={
            "misjudged": float(np.sum(judged == (growth > GROWS))),
            "growth": float(np.abs(growth - exact).max()),
            "motion": off.max(),
        },
        motion=Picture("k1", "k3", (*_borders(), *_dots(growth))),
        error=Curve("relative error of the motion", INTERVAL * np.arange(off.size), off),
    )


def _let_go(conditions: Conditions, moments: Array) -> tuple[Array, Array]:
    """Return the eigenvalues [1/s] of a flight near upright, and its relative error (n,)."""

    def reshape(spec: Any) -> None:
        spec.body("bus").inertia = moments

    model = stand.build(conditions, "orbiter", adapt=reshape, outside=Environment(orbit=ORBIT))
    begin = SMALL * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    duration = INTERVAL * SAMPLES
    _, q, rate = librate(conditions, model, begin, duration, SAMPLES)
    states = np.concatenate([attitude.to_rotation_vector(q), rate / RATE], axis=1)
    step, exact = expm(INTERVAL * linear(moments)), [begin]
    for _ in range(SAMPLES):
        exact.append(step @ exact[-1])
    theory = np.array(exact) / [1.0, 1.0, 1.0, RATE, RATE, RATE]
    departure = np.linalg.norm(states - theory, axis=1) / np.linalg.norm(theory, axis=1)
    return eigenvalues(states, INTERVAL), departure


def _borders() -> tuple[Curve, Curve]:
    """Return the outlines of both regions."""
    # 1 + 3 k1 + k1 k3 = 4 sqrt(k1 k3), from the diagonal to k3 = -1
    k1 = np.linspace(0.5 * (np.sqrt(45.0) - 7.0), np.sqrt(6.0) - 2.5, 50)
    k3 = (2.0 - np.sqrt(3.0 - 3.0 * k1)) ** 2 / k1
    return (
        Curve("Lagrange", np.array([0.0, 1.0, 1.0, 0.0]), np.array([0.0, 1.0, 0.0, 0.0])),
        Curve("DeBra-Delp", np.array([0.0, *k1, 0.0, 0.0]), np.array([0.0, *k3, -1.0, 0.0])),
    )


def _dots(growth: Array) -> tuple[Curve, Curve]:
    """Return the shapes as MuJoCo flew them."""
    (k1, k3), falls = SHAPES.T, growth > GROWS
    return (
        Curve("stays", k1[~falls], k3[~falls], dots=True),
        Curve("falls", k1[falls], k3[falls], dots=True),
    )


BENCHMARKS = (
    Benchmark(
        name="debra-delp",
        title="Shapes that the gravity gradient stabilizes upright",
        shows=(
            "On both sides of every border of the Lagrange and DeBra-Delp regions MuJoCo's "
            "satellite is stable or falls as the theory predicts, and falls as fast; first-order "
            "integrators damp or excite the motion by n h / 2."
        ),
        source=(
            "DeBra and Delp, Rigid body attitude stability and natural frequencies in a circular "
            "orbit, 1961; Hughes, Spacecraft Attitude Dynamics, 1986, chapter 9"
        ),
        step=10.0,
        bounds=(
            Bound("misjudged", f"of {len(SHAPES)} shapes", 0.0, "none: 0.2 n is the slowest fall"),
            Bound(
                "growth",
                "of the orbital rate",
                5e-6,
                "10 s is 1/90 rad of the orbit: RK4's (2 n h)^4 / 120 is 2e-9; nonlinear "
                "terms at 1e-7 rad have grown to 5e-7, measured",
            ),
            Bound("motion", "of itself", 5e-6, "as the growth; 4e-7 measured"),
        ),
        fly=fly,
        catches={
            "sign": "the orbital rate of the release added the wrong way round",
            "armature": "",
            "integrator": "",
            "held": "",
            "inertia": "",
        },
    ),
)
