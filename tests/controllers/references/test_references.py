"""Wanted motions: their parts agree with each other, and pass through the places they should."""

import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from mjspace.controllers.references.references import (
    EulerSinusoids,
    Hold,
    MultiAxis,
    Regulation,
    Slew,
    Sweep,
    Turning,
)
from mjspace.controllers.references.tabulated import Table

from mjspace import attitude as att

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
K = np.ones(3) / np.sqrt(3.0)


def tabulated(times: np.ndarray, signs: np.ndarray | None = None, ends: Any = "rest") -> Table:
    attitude = MultiAxis().at(times).attitude
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it moves at its end
        return Table(times, attitude if signs is None else attitude * signs[:, None], ends)


number = st.floats(-1.0, 1.0)
vector = arrays(float, 3, elements=number).filter(lambda v: np.linalg.norm(v) > 0.1)
quaternion = (
    arrays(float, 4, elements=number)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: q / np.linalg.norm(q))
)
time = st.floats(0.5, 4.0)
angles = arrays(float, 3, elements=st.floats(0.1, 0.7))
SOURCES = st.one_of(
    st.builds(Hold, quaternion),
    st.builds(Turning, vector, quaternion),
    st.builds(Slew, quaternion, time, st.floats(-1.0, 2.0), quaternion),
    st.builds(Regulation, st.floats(-12.0, 12.0), time, vector),
    st.builds(Sweep, st.floats(-1.0, 1.0), st.just(0.5), time, vector),
    st.builds(MultiAxis, angles, angles),
    st.builds(EulerSinusoids, angles.map(lambda a: 2.0 * a), angles.map(lambda w: 2.0 * w)),
    st.just(tabulated(np.linspace(0.0, 3.0, 31))),
    st.just(tabulated(np.linspace(0.0, 3.0, 31), ends="continue")),
)


@settings(deadline=None)
@given(SOURCES, arrays(float, 5, elements=st.floats(0.01, 2.99)))
def test_rate_and_acceleration_are_the_derivatives(source: Any, times: np.ndarray) -> None:
    h = 1e-5
    before, now, after = (source.at(times + shift) for shift in (-h, 0.0, h))
    dq = (after.attitude - before.attitude) / (2.0 * h)
    spin = 2.0 * att.multiply(att.conjugate(now.attitude), dq)
    w, a = (np.abs(part).sum(axis=-1).max() for part in (now.rate, now.acceleration))
    jerk = np.abs(after.acceleration - before.acceleration).sum(axis=-1).max() / h
    # Twice h^2/6 of the quaternion's third derivative, at most w^3/8 + 3 w a/4 + jerk/2, with a
    # margin for what varies over h; and rounding, 1e-16/h. Where a motion starts, the jerk jumps.
    truncation = h * h * (w**3 / 8.0 + 0.75 * w * a + 0.5 * jerk) + 2e-10
    np.testing.assert_allclose(spin[:, 1:], now.rate, atol=truncation)
    np.testing.assert_allclose(spin[:, 0], 0.0, atol=truncation)
    bend = (after.rate - before.rate) / (2.0 * h)
    # Half the jump of the jerk, times h; elsewhere h^2/6 of its derivative is far less.
    np.testing.assert_allclose(bend, now.acceleration, atol=h * jerk + 5e-8)


@settings(deadline=None)
@given(SOURCES)
def test_the_quaternion_is_a_unit_and_its_path_never_jumps(source: Any) -> None:
    times = np.linspace(-1.0, 8.0, 901)
    wanted = source.at(times)
    np.testing.assert_allclose(np.linalg.norm(wanted.attitude, axis=-1), 1.0, atol=1e-14)
    steps = np.linalg.norm(np.diff(wanted.attitude, axis=0), axis=-1)
    # |q'| = |w|/2; a change of sign would be a step of 2. The rate may peak between the samples.
    assert steps.max() <= 0.5 * 0.01 * 1.05 * np.linalg.norm(wanted.rate, axis=-1).max() + 1e-12


@settings(deadline=None)
@given(SOURCES)
def test_a_row_does_not_depend_on_its_neighbours(source: Any) -> None:
    times = np.linspace(0.0, 3.0, 7)
    together = source.at(times)
    for i in range(len(times)):
        # To the bit: a replay that starts in the middle asks for the later rows only.
        alone = source.at(times[i : i + 1])
        assert all(
            np.array_equal(one[0], rows[i]) for one, rows in zip(alone, together, strict=True)
        )


def test_sweep_at_known_instants() -> None:
    wanted = Sweep().at(np.array([0.0, 1.0, 3.0, 5.0, 6.0, 20.0]))
    omega = np.radians(30.0)
    # attitude.md 3.2: ta (s^3 - s^4/2), Om (t - 1), its mirror image, Om tb = 120 deg and hold.
    turned = omega * np.array([0.0, 0.1875, 2.0, 3.0 + 2.0 * (0.5 - 0.125 + 0.03125), 4.0, 4.0])
    expected = att.from_rotation_vector(turned[:, None] * K)
    np.testing.assert_allclose(wanted.attitude, expected, atol=1e-15)
    speed = omega * np.array([0.0, 0.5, 1.0, 0.5, 0.0, 0.0])
    np.testing.assert_allclose(wanted.rate, speed[:, None] * K, atol=1e-15)
    push = omega / 2.0 * np.array([0.0, 1.5, 0.0, -1.5, 0.0, 0.0])
    np.testing.assert_allclose(wanted.acceleration, push[:, None] * K, atol=1e-15)


def test_regulation_peaks_as_reconstructed() -> None:
    wanted = Regulation().at(np.linspace(0.0, 3.0, 3001))
    # attitude.md 3.2: "peak 1.9635 rad/s, 3.023 rad/s^2", to its rounding.
    assert np.linalg.norm(wanted.rate, axis=-1).max() == pytest.approx(1.9635, abs=5e-5)
    assert np.linalg.norm(wanted.acceleration, axis=-1).max() == pytest.approx(3.023, abs=5e-4)
    end = att.from_rotation_vector(np.radians(120.0) * K)
    np.testing.assert_allclose(wanted.attitude[2000:], [end] * 1001, atol=1e-15)


def test_slew_goes_the_shorter_way_from_rest_to_rest() -> None:
    start = att.from_euler_zyx(np.array([0.3, -0.2, 3.0]))
    end = att.from_euler_zyx(np.array([0.1, 0.4, -3.0]))  # across the seam of yaw
    wanted = Slew(-end, 10.0, 5.0, start).at(np.linspace(0.0, 20.0, 2001))
    for row, place in ((0, start), (500, start), (1500, end), (2000, end)):
        assert att.rotation_angle(wanted.attitude[row], place) < 1e-14  # rounding
        assert not wanted.rate[row].any()
        assert np.abs(wanted.acceleration[row]).max() < 1e-14
    path = 0.01 * np.linalg.norm(wanted.rate, axis=-1).sum()
    # The sum of a smooth bump over 1000 samples is its integral to rounding.
    assert path == pytest.approx(att.rotation_angle(start, end), rel=1e-9)


def test_multi_axis_starts_at_rest_at_the_identity() -> None:
    wanted = MultiAxis().at(np.zeros(1))
    assert np.array_equal(wanted.attitude[0], IDENTITY)
    assert not wanted.rate.any()


def test_euler_sinusoids_are_sinusoids_in_euler_angles() -> None:
    times = np.linspace(0.0, 7.0, 71)
    angles = att.to_euler_zyx(EulerSinusoids().at(times).attitude)
    expected = np.sin(times[:, None] * np.array([5.0, 2.0, 1.0]))
    np.testing.assert_allclose(angles, expected, atol=1e-14)


def test_table_passes_its_points_and_holds_its_ends() -> None:
    times = np.array([1.0, 1.5, 2.5, 3.0, 4.5])
    given_ = MultiAxis().at(times).attitude
    table = tabulated(times, np.array([1.0, -1.0, -1.0, 1.0, -1.0]))
    np.testing.assert_allclose(table.at(times).attitude, given_, atol=1e-15)
    ends = table.at(np.array([-10.0, 1.0, 4.5, 100.0]))
    np.testing.assert_allclose(ends.attitude, given_[[0, 0, -1, -1]], atol=1e-15)
    np.testing.assert_allclose(ends.rate, 0.0, atol=1e-14)
    np.testing.assert_allclose(ends.acceleration[[0, 3]], 0.0, atol=1e-14)


def test_table_converges_at_fourth_order() -> None:
    turn = Regulation(angle=2.0, duration=4.0)  # at rest at both ends, as a table is
    fine = np.linspace(0.0, 4.0, 997)
    errors = []
    for points in (21, 41, 81):
        times = np.linspace(0.0, 4.0, points)
        wanted = Table(times, turn.at(times).attitude).at(fine)
        errors.append(att.rotation_angle(wanted.attitude, turn.at(fine).attitude).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (orders > 3.8).all(), orders  # cubic splines: 4


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Hold(np.zeros(4)), "attitude: .* norm is 0"),
        (lambda: Slew(IDENTITY, 0.0), "duration: got 0 s"),
        (lambda: Slew(IDENTITY, 1.0, 0.0, np.zeros(4)), "start_attitude: .* norm is 0"),
        (lambda: Sweep(ramp=3.0, cruise_end=2.0), "cruise_end: got 2 s,.* 3 s"),
        (lambda: Sweep(axis=np.full(3, np.nan)), "axis.* a number"),
        (lambda: Regulation(duration=-1.0), "duration: got -1 s"),
        (lambda: MultiAxis(np.array([0.0, 0.8, 0.0])), "pitch reaches 91.7 deg"),
        (lambda: EulerSinusoids(np.array([0.0, 1.6, 0.0])), "pitch reaches 91.7 deg"),
        (lambda: Table(np.array([0.0, 1.0]), IDENTITY[None]), "attitude: 1 rows for 2 of time"),
        (lambda: tabulated(np.array([0.0, 2.0, 1.0])), r"time: \[2\] 1 is not after \[1\] 2"),
        (lambda: Table(np.array([0.0, 1.0]), np.zeros((2, 4))), r"attitude: .* norm is 0"),
    ],
)
def test_what_cannot_be_flown_is_refused(build: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        build()


def test_a_table_that_moves_at_its_end_says_so_and_can_go_on() -> None:
    times = np.linspace(0.0, 4.0, 81)
    turning = Turning(np.array([0.0, 0.0, 0.2])).at(times).attitude
    with pytest.warns(UserWarning, match=r"turn at 0.2 rad/s at [04] s, where the reference rests"):
        resting = Table(times, turning)
    late = np.array([4.0, 7.0])
    assert np.abs(resting.at(late).rate).max() < 1e-15
    goes_on = Table(times, turning, "continue").at(np.array([-2.0, *late]))
    wanted = Turning(np.array([0.0, 0.0, 0.2])).at(np.array([-2.0, *late]))
    # Not-a-knot on steps of 10 mrad: 1.2e-8 rad/s at the ends, carried on for 3 s.
    np.testing.assert_allclose(goes_on.rate, wanted.rate, atol=1e-7)
    np.testing.assert_allclose(goes_on.attitude, wanted.attitude, atol=1e-7)


def test_a_table_from_rest_to_rest_does_not_warn() -> None:
    times = np.linspace(0.0, 10.0, 21)
    Table(times, Slew(att.from_euler_zyx(np.array([0.3, -0.2, 2.0])), 10.0).at(times).attitude)


def test_a_table_can_refuse_what_is_beyond_its_ends() -> None:
    table = tabulated(np.linspace(0.0, 3.0, 31), ends="refuse")
    table.at(np.array([0.0, 3.0]))
    with pytest.raises(ValueError, match=r"the table has 0 to 3 s, without 3.1 s: add rows"):
        table.at(np.array([2.9, 3.1]))
