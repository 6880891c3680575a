"""The loads and the jitter of an unbalanced wheel, from weights on a rod and by integration."""

import numpy as np
from scipy.integrate import solve_ivp

from mjspace.validation.benchmarks.imbalance import (
    AXIAL,
    DISPLACEMENT,
    DYNAMIC,
    MASS,
    SPEED,
    STATIC,
    TILT,
    TRANSVERSE,
    exact_jitter,
    exact_load,
)


def test_loads_are_those_that_keep_weights_on_their_circles() -> None:
    # One weight makes the static imbalance; two, opposite and apart along the axis, the dynamic.
    radius, height = 0.1, 0.05  # m
    static, dynamic = STATIC / radius, DYNAMIC / (2.0 * radius * height)  # kg
    weights = [
        (static, np.array([radius, 0.0, 0.0])),
        (dynamic, np.array([radius, 0.0, height])),
        (dynamic, np.array([-radius, 0.0, -height])),
    ]
    for angle in (0.0, 0.4, 2.5):
        cosine, sine = np.cos(angle), np.sin(angle)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        force, torque = np.zeros(3), np.zeros(3)
        for mass, place in weights:
            pull = -mass * SPEED**2 * (turn @ place) * [1.0, 1.0, 0.0]
            force += pull
            torque += np.cross(turn @ place, pull)
        held_by = exact_load(np.array([angle]))
        # Rounding of a few products.
        np.testing.assert_allclose(held_by[0][0], force, atol=1e-14)
        np.testing.assert_allclose(held_by[1][0], torque, atol=1e-14)


def test_loads_and_amplitudes_of_the_reference() -> None:
    assert np.linalg.norm(exact_load(np.zeros(1))[0]) == 1.8  # N
    assert np.linalg.norm(exact_load(np.zeros(1))[1]) == 0.72  # N m
    assert abs(DISPLACEMENT - 4.7619e-8) < 5e-13  # m, to the digits given
    assert abs(TILT - 2.002e-7) < 5e-11  # rad


def test_jitter_solves_the_equations_of_the_free_bus() -> None:
    """Integrate displacement and tilt, each with its rate, from where the closed form starts."""

    def derivative(time: float, y: list[complex]) -> list[complex]:
        turn = np.exp(1j * SPEED * time)
        # The total momentum stays: M r'' + (U_s e)'' = 0 for what the wheel carries round.
        push = STATIC * SPEED**2 * turn / MASS
        twist = (1j * AXIAL * SPEED * y[3] + 1j * DYNAMIC * SPEED**2 * turn) / TRANSVERSE
        return [y[1], push, y[3], twist]

    start = [part[0] for part in exact_jitter(np.zeros(1))]
    y0 = [start[0], 1j * SPEED * start[0], start[1], 1j * SPEED * start[1]]
    end = 0.1  # s, ten turns and a half
    y = solve_ivp(derivative, (0.0, end), y0, "DOP853", rtol=1e-12, atol=1e-22).y[:, -1]
    displacement, tilt = (part[0] for part in exact_jitter(np.array([SPEED * end])))
    # 1e-12 of every step, over 60 rad of phase.
    assert abs(y[0] - displacement) < 1e-10 * DISPLACEMENT
    assert abs(y[2] - tilt) < 1e-10 * TILT
