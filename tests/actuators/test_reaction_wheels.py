"""Reaction wheels: their reaction, its sharing, and the limits of torque and speed."""

from math import sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import linprog

from mjspace.actuators.reaction_wheels import ReactionWheels

PYRAMID = [[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]]
SKEW = [[1, 0.2, 0], [0, 1, 0.3], [0.1, 0, 1]]
LAYOUTS = {"orthogonal": np.eye(3).tolist(), "skew": SKEW, "pyramid": PYRAMID}
layouts = pytest.mark.parametrize("axes", LAYOUTS.values(), ids=LAYOUTS.keys())
UNEVEN = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 2, 3]]
PLANAR = [[1, 0, 0], [-1, 2, 0], [-1, -2, 0], [0, 0, 1]]
STEP, INERTIA = 0.03, 0.05  # s, kg m^2
components = st.integers(-(10**9), 10**9).map(lambda micro: 1e-6 * micro)  # none subnormal


def wheels(axes: Any = LAYOUTS["orthogonal"], **limits: Any) -> ReactionWheels:
    rows = np.array(axes, dtype=float)
    axes = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    return ReactionWheels(axes, inertia=np.full(len(axes), INERTIA), **limits)


def test_the_bus_is_turned_by_the_reaction_of_the_wheel() -> None:
    ctrl, saturated = wheels().motor_torque(np.array([0.0, 0.0, 2.0]), np.zeros(3), STEP)
    assert ctrl.tolist() == [0.0, 0.0, -2.0]
    assert saturated.tolist() == [0.0, 0.0, 0.0]


def test_four_wheels_of_a_pyramid_share_a_torque_evenly() -> None:
    ctrl, _ = wheels(PYRAMID).motor_torque(np.array([0.0, 0.0, 1.0]), np.zeros(4), STEP)
    # each lends cos(54.7 deg) = 1/sqrt(3) of its own: four of them make 1; one rounding each
    assert np.allclose(ctrl, -sqrt(3.0) / 4.0, rtol=1e-15, atol=0.0)


@layouts
@given(torque=arrays(float, 3, elements=components))
@settings(max_examples=100, deadline=None)
def test_without_limits_the_bus_gets_the_wanted_torque(axes: Any, torque: Any) -> None:
    team = wheels(axes)
    ctrl, saturated = team.motor_torque(torque, np.zeros(len(axes)), STEP)
    assert not saturated.any()
    # rounding of products with matrices of condition below 2
    assert np.abs((-ctrl @ team.axes) - torque).max() <= 1e-14 * np.abs(torque).max()


@given(torque=arrays(float, 3, elements=components), spare=st.floats(-1e2, 1e2))
@settings(max_examples=100, deadline=None)
def test_of_all_torques_that_would_do_it_takes_the_least(torque: Any, spare: float) -> None:
    team = wheels(PYRAMID)
    ctrl, _ = team.motor_torque(torque, np.zeros(4), STEP)
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
        ctrl, _ = team.motor_torque(torque, np.zeros(4), STEP)
        assert np.abs(-ctrl @ team.axes - torque).max() < 1e-14 * np.abs(torque).max() * 10.0
        peak = np.abs(ctrl).max()
        assert peak == pytest.approx(least_peak(team, torque), rel=1e-9)  # the solver's tolerance
        norm = least_squares.motor_torque(torque, np.zeros(4), STEP)[0]
        assert peak <= np.abs(norm).max() * (1.0 + 1e-15)


def test_along_a_wheel_of_a_pyramid_the_peak_is_two_thirds() -> None:
    torque = np.ones(3) / sqrt(3.0)
    by_norm, _ = wheels(PYRAMID).motor_torque(torque, np.zeros(4), STEP)
    by_peak, _ = wheels(PYRAMID, shared_by="least_peak").motor_torque(torque, np.zeros(4), STEP)
    np.testing.assert_allclose(by_norm, [-0.75, -0.25, 0.25, -0.25], atol=1e-15)
    np.testing.assert_allclose(by_peak, [-0.5, -0.5, 0.5, -0.5], atol=1e-15)


def test_a_wheel_that_can_lend_nothing_leaves_the_others_where_their_norm_is_least() -> None:
    # The planar three share x and y; z is the fourth's alone, and its torque is the peak.
    torque = np.array([0.1, 0.2, 5.0])
    by_norm, _ = wheels(PLANAR).motor_torque(torque, np.zeros(4), STEP)
    by_peak, _ = wheels(PLANAR, shared_by="least_peak").motor_torque(torque, np.zeros(4), STEP)
    np.testing.assert_array_equal(by_peak, by_norm)


@pytest.mark.parametrize("axes", [SKEW, [*PYRAMID, [0, 0, 1]]], ids=["three", "five"])
def test_least_peak_is_refused_where_there_is_no_one_number_to_choose(axes: Any) -> None:
    with pytest.raises(ValueError, match="one wheel more than their axes span"):
        wheels(axes, shared_by="least_peak")


def test_a_torque_along_no_wheel_is_given_as_nearly_as_can_be() -> None:
    team = wheels([[1, 0, 0], [0, 1, 0]])
    ctrl, saturated = team.motor_torque(np.array([1.0, 2.0, 3.0]), np.zeros(2), STEP)
    assert ctrl.tolist() == [-1.0, -2.0]
    assert saturated.tolist() == [1.0, 1.0]  # z is nobody's
    _, saturated = team.motor_torque(np.array([1.0, 2.0, 1e-10]), np.zeros(2), STEP)
    assert not saturated.any()  # rounding in a law


@pytest.mark.parametrize("axes", [[[0, 0, 1]], [[1, 0, 0], [0, 1, 0]], PLANAR[:3]])
def test_the_axes_about_which_no_wheel_turns_the_bus_are_known(axes: Any) -> None:
    team = wheels(axes)
    assert len(team.unreachable) == 3 - np.linalg.matrix_rank(team.axes)
    np.testing.assert_allclose(team.axes @ team.unreachable.T, 0.0, atol=1e-15)
    assert not len(wheels(PYRAMID).unreachable)


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
    ctrl, saturated = team.motor_torque(torque, speed, STEP)
    wanted, _ = wheels(axes).motor_torque(torque, speed, STEP)

    assert np.all(np.abs(ctrl) <= torque_limit)
    after = speed + STEP / INERTIA * ctrl
    # within the limit, or slower than before
    assert np.all(np.abs(after) <= np.maximum(np.abs(speed), speed_limit) * (1.0 + 1e-15))
    # what a limit does not forbid is applied in full, and only the rest is flagged
    least = np.minimum(-speed_limit - speed, 0.0) * INERTIA / STEP
    most = np.maximum(speed_limit - speed, 0.0) * INERTIA / STEP
    clipped = np.clip(np.clip(wanted, -torque_limit, torque_limit), least, most)
    assert np.array_equal(ctrl, clipped)
    assert np.array_equal(saturated, np.where(ctrl != wanted, 1.0, 0.0))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_wheel_at_its_speed_limit_can_be_slowed_but_not_driven(sign: float) -> None:
    team = wheels(torque_limit=1.0, speed_limit=100.0)
    speed = sign * np.array([100.0, 100.0, 99.0])
    ctrl, saturated = team.motor_torque(sign * np.array([-0.5, 0.5, -0.5]), speed, STEP)
    assert ctrl.tolist() == [0.0, -0.5 * sign, 0.5 * sign]
    assert saturated.tolist() == [1.0, 0.0, 0.0]


@pytest.mark.parametrize("step", [1e-4, 0.03, 1.0])
def test_a_wheel_driven_into_its_limit_ends_its_step_there(step: float) -> None:
    team, speed = wheels(torque_limit=0.2, speed_limit=10.0), np.zeros(3)
    for _ in range(int(4.0 / step)):  # 2.5 s to the limit
        ctrl, saturated = team.motor_torque(np.array([-5.0, 0.0, 0.0]), speed, step)
        speed = speed + ctrl * step / INERTIA
        assert speed[0] <= 10.0 * (1.0 + 1e-15)
    assert speed[0] == pytest.approx(10.0, rel=1e-15)
    assert ctrl.tolist() == [0.0, 0.0, 0.0]
    assert saturated.tolist() == [1.0, 0.0, 0.0]


def test_a_speed_limit_needs_the_rotors_inertia() -> None:
    with pytest.raises(ValueError, match="speed_limit needs the inertia of each of the 3 rotors"):
        ReactionWheels(np.eye(3), speed_limit=10.0)


def test_not_a_number_is_passed_on_and_flagged() -> None:
    team = wheels(torque_limit=1.0, speed_limit=1.0)
    with np.errstate(invalid="ignore"):
        ctrl, saturated = team.motor_torque(np.array([np.nan, 0.0, 0.0]), np.zeros(3), STEP)
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
    ctrl, saturated = team.motor_torque(torque, speed, STEP)
    assert 0 < saturated.sum() < saturated.size
    for row in range(129):
        one, flag = team.motor_torque(torque[row], speed[row], STEP)
        assert one.tobytes() == ctrl[row].tobytes()
        assert flag.tobytes() == saturated[row].tobytes()


def test_each_wheel_has_limits_of_its_own() -> None:
    team = ReactionWheels(
        np.eye(3), np.array([0.1, 0.2, np.inf]), np.array([np.inf, 10.0, 20.0]), inertia=np.ones(3)
    )
    speed = np.array([0.0, -9.9, 19.95])
    ctrl, saturated = team.motor_torque(np.array([1.0, 1.0, -1.0]), speed, 1.0)
    # By its torque limit, by its speed limit, which is nearer, and likewise.
    np.testing.assert_allclose(ctrl, [-0.1, -0.1, 0.05], atol=1e-14)
    assert saturated.tolist() == [1.0, 1.0, 1.0]
    ctrl, saturated = team.motor_torque(np.array([1.0, 1.0, -1.0]), np.zeros(3), 1.0)
    np.testing.assert_allclose(ctrl, [-0.1, -0.2, 1.0], atol=1e-14)
    assert saturated.tolist() == [1.0, 1.0, 0.0]
    ctrl, saturated = team.motor_torque(np.array([0.05, -0.15, 5.0]), np.zeros(3), 1.0)
    np.testing.assert_allclose(ctrl, [-0.05, 0.15, -5.0], atol=1e-15)
    assert not saturated.any()
    _, largest = team.limits()["torque"]
    assert largest.tolist() == [0.1, 0.2, np.inf]
