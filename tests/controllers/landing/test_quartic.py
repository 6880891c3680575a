"""Apollo's quadratic guidance: against the quartic that it is the acceleration of."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mjspace.controllers.landing.quartic import Target, acceleration, time_to_go

from mjspace.contract import Array

PARTS = st.lists(st.floats(-1.0, 1.0), min_size=15, max_size=15)
SIZES = np.array([[6e3], [150.0], [3.0], [4e-3], [1e-5]])  # m, m/s, ... m/s^4 at the target


def quartic(parts: list[float]) -> Array:
    """Return position to snap at the target, (5, 3)."""
    return np.array(parts).reshape(5, 3) * SIZES


def at(path: Array, T: float) -> Array:
    """Return position, velocity and acceleration on the path at ``T`` [s] from its target."""
    r, v, a, j, s = path
    return np.array(
        [
            r + v * T + a * T**2 / 2 + j * T**3 / 6 + s * T**4 / 24,
            v + a * T + j * T**2 / 2 + s * T**3 / 6,
            a + j * T + s * T**2 / 2,
        ]
    )


@given(PARTS, st.floats(2.0, 500.0))
def test_on_a_quartic_it_returns_the_quartics_acceleration(parts: list[float], left: float) -> None:
    path = quartic(parts)
    position, velocity, expected = at(path, -left)
    found = acceleration(position, velocity, Target(*path[:3]), np.array([left]))
    # 12 / t^2 of the rounding of 6 km, 1e-12 m
    assert found == pytest.approx(expected, abs=1e-9)


def test_the_time_to_go_is_that_of_the_targets_jerk() -> None:
    # A braking as in lander-from-orbit; the guess is 20 % off.
    path = np.zeros((5, 3))
    path[:, 0] = 6e3, -150.0, 3.4, -3.6e-3, -1.2e-5
    for left in (100.0, 300.0, 470.0):
        position, velocity, _ = at(path, -left)
        goal = tuple(path[k, :1] for k in (1, 2, 3))
        found = time_to_go(path[0, :1] - position[:1], velocity[:1], goal, np.array([1.2 * left]))
        assert found == pytest.approx(left, rel=1e-9)


def test_it_meets_its_target_from_where_it_is_thrown() -> None:
    target = Target(*(np.array(row) for row in ([10.0, 0, 30], [0.0, 0, -2], [0.2, 0, 0.1])))
    r, v = np.array([6e3, 40.0, 2100.0]), np.array([-155.0, 2.0, -46.0])
    left, h = np.array([140.0]), 0.01
    goal = target.velocity[:1], target.acceleration[:1], np.zeros(1)
    while left[0] > 3.0:
        left = time_to_go(target.position[:1] - r[:1], v[:1], goal, left)
        a = acceleration(r, v, target, left)
        r, v, left = r + h * v + 0.5 * h**2 * a, v + h * a, left - h
    # 3 s before the target on a path that ends with its velocity and acceleration
    expected = target.position - 3.0 * target.velocity + 4.5 * target.acceleration
    assert r == pytest.approx(expected, abs=0.5)
    assert v == pytest.approx(target.velocity - 3.0 * target.acceleration, abs=0.3)


def test_no_time_to_go_is_taken_for_less_than_a_second() -> None:
    target = Target(*(np.array(row) for row in ([10.0, 0, 30], [0.0, 0, -2], [0.2, 0, 0.1])))
    r, v = np.array([12.0, 1.0, 32.0]), np.array([-1.0, 0.0, -2.5])
    # a_T + 12 (r_T - r) / t^2 - 6 (v + v_T) / t at t = 1 s
    right = [0.2 - 24.0 + 6.0, -12.0, 0.1 - 24.0 + 27.0]
    for left in (1.0, 0.3, 0.0, -2.0):
        assert acceleration(r, v, target, np.array([left])) == pytest.approx(right)
