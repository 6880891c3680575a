"""The dampers' exact equations against Newton's and Euler's; the parts against the pages."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace import attitude
from mjspace.contract import Array
from mjspace.validation import stand
from mjspace.validation.benchmark import Conditions
from mjspace.validation.benchmarks import dampers, flat_spin
from mjspace.validation.benchmarks.dampers import NUTATING, RINGS, TIME, TUBES, Ring, Tube

X, Z = np.eye(3)[[0, 2]]
BOUNDS = {
    benchmark.name: {bound.quantity: bound for bound in benchmark.bounds}
    for benchmark in dampers.BENCHMARKS + flat_spin.BENCHMARKS
}


def tube_slopes(case: Tube) -> Callable[[float, Array], Array]:
    """Newton's and Euler's equations for (q, w, z, z'): the ball pushes the bus as the bus it."""
    inertia = np.diag(case.bus) + dampers.BALL_INERTIA * np.eye(3)
    m = dampers.BUS_MASS * case.mass / (dampers.BUS_MASS + case.mass)

    def slopes(_: float, state: Array) -> Array:
        q, w, (z, speed) = state[:4], state[4:7], state[7:]
        r = np.array([dampers.MOUNT, 0.0, z])
        known = np.cross(w, np.cross(w, r)) + 2.0 * np.cross(w, speed * Z)
        matrix = np.zeros((4, 4))
        matrix[:3, :3] = inertia + m * (r @ r * np.eye(3) - np.outer(r, r))
        matrix[:3, 3] = matrix[3, :3] = m * np.cross(r, Z)
        matrix[3, 3] = m
        right = np.zeros(4)
        right[:3] = -np.cross(w, inertia @ w) - m * np.cross(r, known)
        right[3] = -case.stiffness * z - case.damping * speed - m * known[2]
        return np.concatenate(
            [turning(q, w), (change := np.linalg.solve(matrix, right))[:3], [speed, change[3]]]
        )

    return slopes


def ring_slopes(case: Ring) -> Callable[[float, Array], Array]:
    """Euler's equations of a gyrostat for (q, w, slip)."""
    whole = np.diag(case.whole)
    matrix = np.block([[whole, case.axial * X[:, None]], [case.axial * X, case.axial]])

    def slopes(_: float, state: Array) -> Array:
        q, w, slip = state[:4], state[4:7], state[7]
        momentum = whole @ w + case.axial * slip * X
        right = np.append(-np.cross(w, momentum), -case.damping * slip)
        return np.concatenate([turning(q, w), np.linalg.solve(matrix, right)])

    return slopes


def turning(q: Array, w: Array) -> Array:
    return 0.5 * attitude.multiply(q, np.append(0.0, w))


def integrate(slopes: Any, duration: float, start: Array) -> Array:
    return solve_ivp(slopes, (0.0, duration), start, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]


@pytest.mark.parametrize("case", [*TUBES.values(), *RINGS.values()])
def test_reduced_equations_are_newtons_and_eulers(case: Tube | Ring) -> None:
    start = np.array([1.0, 0.0, 0.0, 0.0, *NUTATING])
    if isinstance(case, Tube):
        end = integrate(tube_slopes(case), TIME[3], np.append(start, [0.0, 0.0]))
    else:
        end = integrate(ring_slopes(case), TIME[3], np.append(start, 0.0))
    rates, attitudes = dampers.exact(case)
    # Most of a turn, three of the dampers' own seconds; DOP853 leaves 1e-12 at that tolerance.
    assert attitude.rotation_angle(attitudes[3], end[:4]) < 2e-11
    np.testing.assert_allclose(rates[3], end[4:7], rtol=0.0, atol=2e-11)


@pytest.mark.parametrize(
    ("benchmark", "name", "case", "eigenvalue"),
    [
        ("tube-damper", "decay, major", TUBES["decay, major"], 170.648),
        ("tube-damper", "growth, minor", TUBES["growth, minor"], 63.93),
        ("tube-damper", "decay, strong", TUBES["decay, strong"], 13.14),
        ("ring-damper", "decay, major", RINGS["decay, major"], 34.229),
        ("ring-damper", "growth, minor", RINGS["growth, minor"], 128.82),
    ],
)
def test_time_constants(benchmark: str, name: str, case: Tube | Ring, eigenvalue: float) -> None:
    measured = dampers.decay_time(dampers.nutation(np.array(case.momentum), dampers.exact(case)[1]))
    assert measured == pytest.approx(BOUNDS[benchmark][name].target, abs=2e-8)
    # The linear equations' own; what differs is the start, before the damper swings.
    assert measured == pytest.approx(eigenvalue, rel=0.015)


@pytest.mark.parametrize(("name", "sink"), [("decay, major", 169.46), ("growth, minor", -62.05)])
def test_weak_tube_damper_is_an_energy_sink(name: str, sink: float) -> None:
    """The damper as a driven oscillator on a body that it does not disturb.

    tau = 2 It (1 - It/I3) / (c n^2 G^2), the ball's inertia in It and I3, half of it across.
    """
    case = TUBES[name]
    m = dampers.BUS_MASS * case.mass / (dampers.BUS_MASS + case.mass)
    It = case.bus[0] + m * dampers.MOUNT**2 / 2.0
    I3 = case.bus[2] + m * dampers.MOUNT**2
    n = (I3 / It - 1.0) * NUTATING[2]
    swing = m * dampers.MOUNT * abs(NUTATING[2] - n)
    swing /= np.hypot(case.stiffness - m * n**2, case.damping * n)
    tau = 2.0 * It * (1.0 - It / I3) / (case.damping * n**2 * swing**2)
    assert tau == pytest.approx(sink, abs=5e-3)
    # What it leaves out is of the order of the damper's second over the time constant.
    assert abs(tau) == pytest.approx(BOUNDS["tube-damper"][name].target, rel=0.04)


@pytest.mark.parametrize("case", [TUBES["decay, major"], RINGS["decay, major"]])
def test_parts_are_what_the_pages_say(case: Tube | Ring) -> None:
    conditions = Conditions(0.01)
    adapted = stand.build(conditions, case.model, adapt=case.adapt)
    plain = stand.build(conditions, case.model)
    for field in ("body_mass", "body_inertia", "body_pos", "dof_damping", "jnt_stiffness"):
        np.testing.assert_allclose(getattr(plain, field), getattr(adapted, field), rtol=1e-15)
    if isinstance(case, Tube):
        np.testing.assert_array_equal(plain.body("damper_ball").inertia, dampers.BALL_INERTIA)
        np.testing.assert_array_equal(plain.body("damper_ball").pos, [dampers.MOUNT, 0.0, 0.0])
        assert plain.body("bus").mass == dampers.BUS_MASS


def test_flat_spin_by_its_closed_form_and_on_its_way() -> None:
    energy = 0.5 * flat_spin.INERTIA @ flat_spin.RATE**2
    assert energy == pytest.approx(16.0024, rel=1e-15)
    assert pytest.approx(1.280143992, abs=5e-10) == flat_spin.FLAT_RATE
    assert energy * (1.0 - flat_spin.ENERGY_LOSS) == pytest.approx(10.242304, abs=5e-7)
    assert pytest.approx(1.0 - 8.0 / 12.5, abs=1e-4) == flat_spin.ENERGY_LOSS

    start = np.array([1.0, 0.0, 0.0, 0.0, *flat_spin.RATE, 0.0])
    q = integrate(ring_slopes(flat_spin.RING), float(flat_spin.HALFWAY), start)[:4]
    h = attitude.rotate(attitude.conjugate(q), flat_spin.MOMENTUM)
    angle = np.arctan2(np.hypot(h[0], h[1]), h[2])
    assert angle == pytest.approx(BOUNDS["flat-spin"]["angle halfway"].target, abs=1e-10)
