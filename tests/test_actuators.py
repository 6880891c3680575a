"""Reaction wheels: their reaction, its sharing, and the limits of torque and speed."""

from math import sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import linprog

from mjspace.actuators import ReactionWheels

PYRAMID = [[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]]
SKEW = [[1, 0.2, 0], [0, 1, 0.3], [0.1, 0, 1]]
LAYOUTS = {"orthogonal": np.eye(3).tolist(), "skew": SKEW, "pyramid": PYRAMID}
layouts = pytest.mark.parametrize("axes", LAYOUTS.values(), ids=LAYOUTS.keys())
UNEVEN = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 2, 3]]
PLANAR = [[1, 0, 0], [-1, 2, 0], [-1, -2, 0], [0, 0, 1]]
components = st.integers(-(10**9), 10**9).map(lambda micro: 1e-6 * micro)  # none subnormal


def wheels(axes: Any = LAYOUTS["orthogonal"], **limits: Any) -> ReactionWheels:
    rows = np.array(axes, dtype=float)
    return ReactionWheels(rows / np.linalg.norm(rows, axis=1, keepdims=True), **limits)


def test_the_bus_is_turned_by_the_reaction_of_the_wheel() -> None:
    ctrl, saturated = wheels().motor_torque(np.array([0.0, 0.0, 2.0]), np.zeros(3))
    assert ctrl.tolist() == [0.0, 0.0, -2.0]
    assert saturated.tolist() == [0.0, 0.0, 0.0]


def test_four_wheels_of_a_pyramid_share_a_torque_evenly() -> None:
    ctrl, _ = wheels(PYRAMID).motor_torque(np.array([0.0, 0.0, 1.0]), np.zeros(4))
    # each lends cos(54.7 deg) = 1/sqrt(3) of its own: four of them make 1; one rounding each
    assert np.allclose(ctrl, -sqrt(3.0) / 4.0, rtol=1e-15, atol=0.0)


@layouts
@given(torque=arrays(float, 3, elements=components))
@settings(max_examples=100, deadline=None)
def test_without_limits_the_bus_gets_the_wanted_torque(axes: Any, torque: Any) -> None:
    team = wheels(axes)
    ctrl, saturated = team.motor_torque(torque, np.zeros(len(axes)))
    assert not saturated.any()
    # rounding of products with matrices of condition below 2
    assert np.abs((-ctrl @ team.axes) - torque).max() <= 1e-14 * np.abs(torque).max()


@given(torque=arrays(float, 3, elements=components), spare=st.floats(-1e2, 1e2))
@settings(max_examples=100, deadline=None)
def test_of_all_torques_that_would_do_it_takes_the_least(torque: Any, spare: float) -> None:
    team = wheels(PYRAMID)
    ctrl, _ = team.motor_torque(torque, np.zeros(4))
    idle = np.array([1.0, -1.0, 1.0, -1.0])  # the pyramid's null space: no torque on the bus
    assert np.abs(-idle @ team.axes).max() < 1e-15
    scale = 1e-14 * (np.linalg.norm(torque) + abs(spare))  # rounding
    assert np.linalg.norm(ctrl) <= np.linalg.norm(ctrl + spare * idle) + scale
    assert abs(ctrl @ idle) <= 1e-14 * np.linalg.norm(torque)


def least_peak(team: ReactionWheels, torque: Any) -> float:
    """Return the least that the largest motor torque [N m] can be, by linear programming."""
    count = len(team.axes)
    bounds = np.block(
        [[np.eye(count), -np.ones((count, 1))], [-np.eye(count), -np.ones((count, 1))]]
    )
    solved = linprog(
        np.eye(count + 1)[-1], A_ub=bounds, b_ub=np.zeros(2 * count),
        A_eq=np.hstack([-team.axes.T, np.zeros((3, 1))]), b_eq=torque, bounds=(None, None),
    )  # fmt: skip
    assert solved.status == 0
    return float(solved.fun)


@pytest.mark.parametrize("layout", [PYRAMID, UNEVEN, PLANAR], ids=["pyramid", "uneven", "planar"])
def test_the_least_peak_is_the_linear_programs(layout: Any) -> None:
    team = wheels(layout, shared_by="least_peak")
    least_squares = wheels(layout)
    for torque in np.random.default_rng(1).normal(size=(50, 3)):
        ctrl, _ = team.motor_torque(torque, np.zeros(4))
        assert np.abs(-ctrl @ team.axes - torque).max() < 1e-14 * np.abs(torque).max() * 10.0
        peak = np.abs(ctrl).max()
        assert peak == pytest.approx(least_peak(team, torque), rel=1e-9)  # the solver's tolerance
        norm = least_squares.motor_torque(torque, np.zeros(4))[0]
        assert peak <= np.abs(norm).max() * (1.0 + 1e-15)


def test_along_a_wheel_of_a_pyramid_the_peak_is_two_thirds() -> None:
    torque = np.ones(3) / sqrt(3.0)
    by_norm, _ = wheels(PYRAMID).motor_torque(torque, np.zeros(4))
    by_peak, _ = wheels(PYRAMID, shared_by="least_peak").motor_torque(torque, np.zeros(4))
    np.testing.assert_allclose(by_norm, [-0.75, -0.25, 0.25, -0.25], atol=1e-15)
    np.testing.assert_allclose(by_peak, [-0.5, -0.5, 0.5, -0.5], atol=1e-15)


def test_a_wheel_that_can_lend_nothing_leaves_the_others_where_their_norm_is_least() -> None:
    # The planar three share x and y; z is the fourth's alone, and its torque is the peak.
    torque = np.array([0.1, 0.2, 5.0])
    by_norm, _ = wheels(PLANAR).motor_torque(torque, np.zeros(4))
    by_peak, _ = wheels(PLANAR, shared_by="least_peak").motor_torque(torque, np.zeros(4))
    np.testing.assert_array_equal(by_peak, by_norm)


@pytest.mark.parametrize("axes", [SKEW, [*PYRAMID, [0, 0, 1]]], ids=["three", "five"])
def test_least_peak_is_refused_where_there_is_no_one_number_to_choose(axes: Any) -> None:
    with pytest.raises(ValueError, match="one wheel more than their axes span"):
        wheels(axes, shared_by="least_peak")


def test_a_torque_along_no_wheel_is_given_as_nearly_as_can_be() -> None:
    team = wheels([[1, 0, 0], [0, 1, 0]])
    ctrl, _ = team.motor_torque(np.array([1.0, 2.0, 3.0]), np.zeros(2))
    assert ctrl.tolist() == [-1.0, -2.0]


@layouts
@given(data=st.data(), torque_limit=st.floats(1e-3, 1e2), speed_limit=st.floats(1.0, 1e3))
@settings(max_examples=100, deadline=None)
def test_no_limit_is_ever_passed(
    axes: Any, data: Any, torque_limit: float, speed_limit: float
) -> None:
    count = len(axes)
    torque = data.draw(arrays(float, 3, elements=components))
    edges = st.sampled_from([-speed_limit, speed_limit, 0.0])
    speed = data.draw(arrays(float, count, elements=components | edges))
    team = wheels(axes, torque_limit=torque_limit, speed_limit=speed_limit)
    ctrl, saturated = team.motor_torque(torque, speed)
    wanted, _ = wheels(axes).motor_torque(torque, speed)

    assert np.all(np.abs(ctrl) <= torque_limit)
    at_limit = np.abs(speed) >= speed_limit
    assert np.all((ctrl * speed)[at_limit] <= 0.0)
    # what a limit does not forbid is given in full, and only the rest is flagged
    slowing = ~at_limit | (wanted * speed <= 0.0)
    clipped = np.clip(wanted, -torque_limit, torque_limit)
    assert np.array_equal(ctrl, np.where(slowing, clipped, 0.0))
    assert np.array_equal(saturated, np.where(ctrl != wanted, 1.0, 0.0))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_wheel_at_its_speed_limit_can_be_slowed_but_not_driven(sign: float) -> None:
    team = wheels(torque_limit=1.0, speed_limit=100.0)
    speed = sign * np.array([100.0, 100.0, 99.999])
    ctrl, saturated = team.motor_torque(sign * np.array([-0.5, 0.5, -0.5]), speed)
    assert ctrl.tolist() == [0.0, -0.5 * sign, 0.5 * sign]
    assert saturated.tolist() == [1.0, 0.0, 0.0]


def test_a_wheel_driven_into_its_limit_stays_within_one_period_of_it() -> None:
    team = wheels(torque_limit=0.2, speed_limit=10.0)
    inertia, period, speed = 0.05, 0.03, np.zeros(3)
    for _ in range(1000):
        ctrl, _ = team.motor_torque(np.array([-5.0, 0.0, 0.0]), speed)
        speed = speed + ctrl * period / inertia
    # 0.12 rad/s is what one period adds; there it coasts, without hunting
    assert 10.0 <= speed[0] < 10.0 + 0.2 * period / inertia
    assert ctrl.tolist() == [0.0, 0.0, 0.0]


def test_not_a_number_is_passed_on_and_flagged() -> None:
    team = wheels(torque_limit=1.0, speed_limit=1.0)
    with np.errstate(invalid="ignore"):
        ctrl, saturated = team.motor_torque(np.array([np.nan, 0.0, 0.0]), np.zeros(3))
    assert np.isnan(ctrl[0])
    assert saturated[0] == 1.0


@pytest.mark.parametrize(
    ("axes", "shared_by"),
    [*((axes, "least_squares") for axes in LAYOUTS.values()), (UNEVEN, "least_peak")],
)
def test_a_vehicle_gets_the_same_bits_alone_and_in_a_batch(axes: Any, shared_by: Any) -> None:
    rng = np.random.default_rng(0)
    team = wheels(axes, torque_limit=0.8, speed_limit=1.0, shared_by=shared_by)
    torque, speed = rng.normal(size=(129, 3)), rng.normal(size=(129, len(axes)))
    ctrl, saturated = team.motor_torque(torque, speed)
    assert 0 < saturated.sum() < saturated.size
    for row in range(129):
        one, flag = team.motor_torque(torque[row], speed[row])
        assert one.tobytes() == ctrl[row].tobytes()
        assert flag.tobytes() == saturated[row].tobytes()
