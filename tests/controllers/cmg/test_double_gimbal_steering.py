"""Parallel double-gimbal CMGs: their steering against the momentum that it steers."""

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mjspace.controllers.cmg.double_gimbal_steering import ParallelCluster, momentum, steer

from mjspace import attitude as att
from mjspace.contract import Array

COUNT, H, SPEED = 4, 4760.0, np.full(4, 7.0)
TURNED = att.normalize(np.array([0.8, -0.3, 0.4, 0.2]))  # of the cluster in the bus
EXACT = np.array([0.1, 0.01, 0.0, 0.0])
EQUAL, NULL = np.array([0.1, 0.01, 0.3, 0.0]), np.array([0.1, 0.01, 0.0, 0.2])


def axes(rolled: Array) -> ParallelCluster:
    """Return the cluster, whose CMGs are mounted ``rolled`` [rad] about the outer axis, (n,)."""
    outer = np.tile([0.0, 0.0, 1.0], (len(rolled), 1))
    spin = np.stack([np.cos(rolled), np.sin(rolled), 0.0 * rolled], axis=-1)
    gimbals = np.stack([outer, np.cross(outer, spin)], axis=1).reshape(-1, 3)
    return ParallelCluster(
        att.rotate(TURNED, gimbals), att.rotate(TURNED, spin), np.full(len(rolled), H / 7.0)
    )


CLUSTER = axes(np.array([0.0, 0.4, -1.1, 2.0]))

angles = st.lists(st.floats(-3.1, 3.1), min_size=COUNT, max_size=COUNT).map(np.array)
tilts = st.lists(st.floats(-1.2, 1.2), min_size=COUNT, max_size=COUNT).map(np.array)
rates = st.lists(st.floats(-200.0, 200.0), min_size=3, max_size=3).map(np.array)


def gimbals(outer: Array, inner: Array) -> Array:
    return np.stack([outer, inner], axis=-1).ravel()


def after(angle: Array, rate: Array) -> Array:
    """Return the rate of the momentum by central differences [N m]."""
    step = 1e-5
    change = momentum(CLUSTER, angle + step * rate, SPEED) - momentum(
        CLUSTER, angle - step * rate, SPEED
    )
    return change / (2.0 * step)


def test_momentum_is_that_of_wheels_turned_by_their_gimbals() -> None:
    angle = gimbals(np.array([0.3, -2.0, 1.0, 2.8]), np.array([0.5, -0.2, 1.1, -0.9]))
    total = np.zeros(3)
    for i in range(COUNT):
        outer, inner = CLUSTER.gimbal_axes[2 * i : 2 * i + 2]
        turns = [
            att.from_rotation_vector(a * d)
            for a, d in ((outer, angle[2 * i]), (inner, angle[2 * i + 1]))
        ]
        total += H * att.rotate(att.multiply(*turns), CLUSTER.spin_axes[i])
    np.testing.assert_allclose(momentum(CLUSTER, angle, SPEED), total, atol=1e-9 * H)


@settings(deadline=None, max_examples=50)
@given(angles, tilts, rates, st.sampled_from([EXACT, EQUAL, NULL]))
def test_the_momentum_changes_as_wanted(
    outer: Array, inner: Array, wanted: Array, gains: Array
) -> None:
    """Also with the motions that equalize and spread the gimbals: they give no torque."""
    angle = gimbals(outer, inner)
    rate, measure = steer(CLUSTER, wanted, angle, SPEED, gains)
    assume(measure[0] > 0.1)
    np.testing.assert_allclose(after(angle, rate), wanted, atol=1e-6 * H)


@settings(deadline=None, max_examples=50)
@given(angles, tilts)
def test_inner_gimbals_approach_each_other_at_the_gain(outer: Array, inner: Array) -> None:
    rate, _ = steer(CLUSTER, np.zeros(3), gimbals(outer, inner), SPEED, EQUAL)
    np.testing.assert_allclose(np.diff(rate[1::2]), -0.3 * np.diff(inner), atol=1e-12)


@settings(deadline=None, max_examples=50)
@given(angles, tilts)
def test_null_motion_never_lowers_the_measure(outer: Array, inner: Array) -> None:
    angle = gimbals(outer, inner)
    rate, before = steer(CLUSTER, np.zeros(3), angle, SPEED, NULL)
    assume(before[0] > 0.1)
    _, later = steer(CLUSTER, np.zeros(3), angle + 1e-4 * rate, SPEED, NULL)
    assert later[0] >= before[0] - 1e-9


def test_it_spreads_gimbals_that_were_close() -> None:
    angle = gimbals(np.array([0.0, -0.3, 1.3, -1.9]), np.zeros(COUNT))
    start = momentum(CLUSTER, angle, SPEED)
    for _ in range(2000):
        rate, measure = steer(CLUSTER, np.zeros(3), angle, SPEED, NULL)
        angle = angle + 0.1 * rate
    assert measure[0] == pytest.approx(1.0, abs=1e-3) or np.linalg.norm(rate) < 1e-6
    np.testing.assert_allclose(momentum(CLUSTER, angle, SPEED), start, atol=2e-2 * H)  # by Euler


def test_the_measure_is_one_over_a_circle_and_zero_in_a_line() -> None:
    mounted = CLUSTER._mounted
    round_about = gimbals(0.5 * np.pi * np.arange(COUNT) - mounted, np.zeros(COUNT))
    in_line = gimbals(0.7 - mounted, np.full(COUNT, 0.2))
    for angle, wanted in ((round_about, 1.0), (in_line, 0.0)):
        rate, measure = steer(CLUSTER, np.array([9.0, 9.0, 9.0]), angle, SPEED, EXACT)
        assert measure[0] == pytest.approx(wanted, abs=1e-7)
        assert np.abs(rate).max() < 0.1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"gimbal_axes": CLUSTER.gimbal_axes[:-1]},
            "7 of 4 wheels, should be an outer and an inner",
        ),
        ({"gimbal_axes": CLUSTER.gimbal_axes[[0, 1, 3, 2, 4, 5, 6, 7]]}, "CMG 1 is not parallel"),
        ({"spin_axes": -CLUSTER.spin_axes}, "CMG 0 is not its outer axis x its spin axis"),
    ],
)
def test_other_arrangements_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ParallelCluster(**{**vars_of(CLUSTER), **change})


def vars_of(cluster: ParallelCluster) -> dict[str, Array]:
    names = ("gimbal_axes", "spin_axes", "wheel_inertia")
    return {name: getattr(cluster, name) for name in names}
