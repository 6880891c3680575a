"""Laws of the phase plane against their closed forms, each on an exact double integrator.

A body on a frictionless axis takes the law's on-times exactly: thrust is constant while it lasts.
Measured: periods and amplitudes come out within 0.4 %: a relay is late by half an integration step.
"""

from collections.abc import Callable
from math import cos, exp, radians, sin, sqrt
from operator import itemgetter
from typing import Any

import numpy as np
import pytest
from mjspace.controllers.attitude.turn import turn
from mjspace.controllers.thrusters import phase_plane as laws
from mjspace.controllers.thrusters.relays import State

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Reference

INERTIA = np.diag([15.0, 12.0, 18.0])
U = 0.5 / 12.0  # rad/s^2
NONE, LEVEL = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
HOLD = Reference(LEVEL, NONE, NONE)
X, Y, Z = np.eye(3)
PLANT: dict[str, Any] = {
    "inertia": INERTIA,
    "thruster_positions": np.array([
        [0, 0.4, -0.5], [0, -0.4, 0.5], [0, -0.4, -0.5], [0, 0.4, 0.5],
        [-0.4, 0, 0.5], [0.4, 0, -0.5], [0.4, 0, 0.5], [-0.4, 0, -0.5],
        [0.4, -0.4, 0], [-0.4, 0.4, 0], [-0.4, -0.4, 0], [0.4, 0.4, 0],
    ]),
    "thruster_directions": np.array([Z, -Z, Z, -Z, X, -X, -X, X, Y, -Y, Y, -Y]),
    "thruster_force": np.full(12, 0.5),
}  # fmt: skip


def law(kind: Callable[..., Any], period: float = 1e-3, **gains: Any) -> Any:
    """Return a law about y alone."""
    return kind(**PLANT, axes=Y[None], control_period=0.5, inner_period=period, **gains)


def seen(angle: float, rate: float) -> Measurement:
    turned = np.array([cos(0.5 * angle), 0.0, sin(0.5 * angle), 0.0])
    return Measurement(attitude=turned, rate=np.array([0.0, rate, 0.0]), wheel_speed=np.zeros(0))


def fly(
    flown: Any, angle: float, rate: float, duration: float, *, push: float = 0.0, late: int = 0
) -> tuple[Array, Array]:
    """Return (rows of t, a, a', which way it fires; total on-time of both senses [s]).

    ``push`` [rad/s^2] is from outside; the command acts ``late`` integration steps later.
    """
    period, rows = flown.inner_period, []
    state = flown.reset(seen(angle, rate), HOLD)
    total, waiting = np.zeros(2), [np.zeros(12)] * late
    for k in range(round(duration / period)):
        if k % round(flown.control_period / period) == 0:
            state, aim, signals = flown.step(state, k * period, seen(angle, rate), HOLD)
        state, command = flown.inner(state, k * period, aim, seen(angle, rate))
        fired = np.sign(command.on_time[4] - command.on_time[6])
        if k % round(flown.control_period / period) == 0:
            assert signals.firing[0] == fired
        rows.append((k * period, angle, rate, fired))
        waiting.append(command.on_time)
        given = waiting.pop(0)[[4, 6]]
        total += given
        on = given.sum()
        u = U * np.sign(given[0] - given[1])
        angle += rate * period + u * on * (period - 0.5 * on) + 0.5 * push * period**2
        rate += u * on + push * period
    return np.array(rows), total


def crossings(rows: Array, column: int = 1) -> Array:
    """Return when the column rises through zero [s], interpolated."""
    t, x = rows[:, 0], rows[:, column]
    k = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    return t[k] - x[k] * (t[k + 1] - t[k]) / (x[k + 1] - x[k])


def test_thrusters_and_inertia_make_the_acceleration() -> None:
    flown = laws.Centre(**PLANT, control_period=0.1, inner_period=1e-3)
    np.testing.assert_allclose(flown.acceleration, [0.4 / 15.0, U, 0.4 / 18.0], rtol=1e-12)
    _, command, _ = law(laws.Centre).step(State(np.zeros((1, 1))), 0.0, seen(-0.1, 0.0), HOLD)
    np.testing.assert_allclose(command.on_time, 1e-3 * (np.eye(12)[4] + np.eye(12)[5]), atol=1e-15)


@pytest.mark.parametrize("degrees", [5.0, 12.0])
def test_a_relay_on_the_angle_is_a_neutral_centre(degrees: float) -> None:
    start = radians(degrees)
    period = 4.0 * sqrt(2.0 * start / U)
    rows, _ = fly(law(laws.Centre, 2e-3), start, 0.0, 1.8 * period)
    assert np.diff(crossings(rows)) == pytest.approx([period], rel=4e-3)
    invariant = 0.5 * rows[:, 2] ** 2 + U * np.abs(rows[:, 1])
    np.testing.assert_allclose(invariant, U * start, rtol=0.01)
    if degrees == 5.0:
        assert period == pytest.approx(8.186613663572, rel=1e-12)


def test_rate_feedback_switches_three_times_and_then_slides() -> None:
    rows, _ = fly(law(laws.Sliding, 1e-3, rate_gain=1.0), -0.21, 0.21, 15.3)
    switch = np.flatnonzero(np.diff(rows[1:, 3]) != 0.0)[:2] + 2
    np.testing.assert_allclose(rows[switch, 2], [-0.126667, 0.043333], rtol=5e-3)
    # |a'| falls to k U = 0.041667 rad/s on the line, and slides from 0.04 on
    sliding = rows[rows[:, 0] > 13.0]
    decay = sliding[0, 1] * np.exp(-(sliding[:, 0] - sliding[0, 0]))
    np.testing.assert_allclose(sliding[:, 1], decay, rtol=0.01)
    assert rows[-1, 1] == pytest.approx(-0.04 * exp(-15.3 + 12.24), rel=0.02)
    assert (rows[1:, 3] != 0.0).all()


def test_behind_a_delay_it_ends_in_a_limit_cycle() -> None:
    period, delay = 5e-4, 0.05
    rows, _ = fly(law(laws.Sliding, period, rate_gain=1.0), 1e-4, 2e-3, 6.0, late=100)
    tau = delay + 0.5 * period  # a sampled loop is later by half its period, on average
    rate = U * tau * (1.0 - 0.5 * tau) / (1.0 - tau)
    assert rate == pytest.approx(2.138158e-3, rel=0.01)
    settled = rows[rows[:, 0] > 4.0]
    assert np.diff(crossings(settled)).mean() == pytest.approx(0.205263, rel=0.01)
    assert np.diff(crossings(settled)).mean() == pytest.approx(4.0 * rate / U, rel=3e-3)
    assert np.abs(settled[:, 2]).max() == pytest.approx(rate, rel=5e-3)


@pytest.mark.parametrize(
    ("angle", "rate"), [(radians(30.0), 0.0), (-radians(30.0), 0.0), (0.2, 0.1), (-0.1, 0.15)]
)
def test_minimum_time_arrives_on_time(angle: float, rate: float) -> None:
    ahead = angle + rate * abs(rate) / (2.0 * U)
    a, v = (angle, rate) if ahead > 0.0 else (-angle, -rate)
    least = v / U + 2.0 * sqrt(a / U + v * v / (2.0 * U * U))
    if v == 0.0:
        assert least == pytest.approx(7.089815403622, rel=1e-12)
    flown = law(laws.MinimumTime, 2e-3)
    rows, _ = fly(flown, angle, rate, least + 0.5)
    off = np.flatnonzero(rows[:, 3] == 0.0)
    assert rows[off[0], 0] == pytest.approx(least, abs=flown.inner_period)
    assert (rows[off[0] :, 3] == 0.0).all()
    assert np.count_nonzero(np.diff(rows[:, 3])) == 2
    assert abs(rows[off[0], 1]) < 1e-3


@pytest.mark.parametrize(
    ("stretch", "first"), [(1.05, 2.587229), (1.5, 1.354034), (2.0, 0.949855), (4.0, 0.450262)]
)
def test_minimum_fuel_burns_coasts_and_burns(stretch: float, first: float) -> None:
    least = 2.0 * sqrt(radians(30.0) / U)
    flown = law(laws.MinimumFuel, 1e-2, final_time=stretch * least)
    rows, total = fly(flown, radians(30.0), 0.0, stretch * least + 0.1)
    np.testing.assert_allclose(total, [first, first], atol=1e-6)
    assert abs(rows[-1, 1]) < 1e-5
    assert abs(rows[-1, 2]) < 1e-9


def test_minimum_fuel_from_a_moving_start() -> None:
    rows, total = fly(law(laws.MinimumFuel, 1e-2, final_time=14.0), -0.3, -0.02, 14.1)
    # the same, mirrored, by the quadratic of the lecture
    roots = np.roots([U, -(U * 14.0 + 0.02), 0.3 + 0.02 * 14.0 + 0.02**2 / (2.0 * U)])
    np.testing.assert_allclose(total, [roots.min(), roots.min() - 0.02 / U], atol=1e-6)
    assert abs(rows[-1, 1]) < 1e-5


def test_a_time_below_the_least_is_refused() -> None:
    with pytest.raises(ValueError, match=r"final_time: got 7 s, no burn, coast and burn"):
        law(laws.MinimumFuel, final_time=7.0).reset(seen(radians(30.0), 0.0), HOLD)


def test_a_schmitt_trigger_ends_in_its_limit_cycle() -> None:
    delta, hysteresis, k = radians(0.5), radians(0.1), 0.3
    flown = law(laws.Schmitt, threshold=delta, hysteresis=hysteresis, rate_gain=k)
    rows, _ = fly(flown, 0.0, 3.3e-3, 32.0)
    v1, on = hysteresis / (2.0 * k), delta - 0.5 * hysteresis
    settled = rows[rows[:, 0] > 18.0]
    assert np.diff(crossings(settled)) == pytest.approx(11.0792527, rel=0.01)
    assert settled[:, 1].max() == pytest.approx(on + v1**2 / (2.0 * U), rel=2e-3)
    assert settled[settled[:, 3] == 0.0, 2].max() == pytest.approx(v1, rel=0.02)
    # from one half cycle to the next the deviation shrinks by -0.6224
    coasts = np.abs([rows[k + 1, 2] for k in np.flatnonzero(np.diff(rows[:, 3] != 0.0))[1::2]])
    slope = (v1 / U - k) / (v1 / U + k)
    assert slope == pytest.approx(-0.6224, abs=1e-4)
    assert (coasts[1] - coasts[-1]) / (coasts[0] - coasts[-1]) == pytest.approx(slope, abs=0.1)


def test_pulses_out_of_the_dead_zone_make_the_least_cycle() -> None:
    delta, dv = radians(0.5), 0.02 * U
    flown = law(laws.MinimumImpulse, 1e-2, dead_zone=delta, pulse=0.02)
    period = 8.0 * delta / dv + 2.0 * 0.02
    assert period == pytest.approx(83.8158041, rel=1e-8)
    rows, total = fly(flown, -1e-9, 0.5 * dv, 1.01 * period)
    assert np.diff(crossings(rows)) == pytest.approx([period], rel=1e-3)
    assert rows[:, 1].max() == pytest.approx(8.728730e-3, rel=1e-3)
    np.testing.assert_allclose(total, [0.02, 0.02], rtol=1e-9)


def test_a_pulse_outlasts_control_periods_and_ends_within_one() -> None:
    flown = law(laws.MinimumImpulse, 0.01, dead_zone=0.01, pulse=0.025)
    state, fired = flown.reset(seen(0.02, 0.001), HOLD), []
    for rate in (0.001, -0.001, -0.001, -0.001):
        _, aim, _ = flown.step(state, 0.0, seen(0.02, rate), HOLD)
        state, command = flown.inner(state, 0.0, aim, seen(0.02, rate))
        fired.append(command.on_time[6])
    np.testing.assert_allclose(fired, [0.01, 0.01, 0.005, 0.0], atol=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_disturbance_makes_the_cycle_one_sided(side: float) -> None:
    dv, d = 0.02 * U, 1e-3 / 12.0
    k = 0.5 * dv / d
    flown = law(laws.MinimumImpulse, 1e-2, dead_zone=radians(0.5), pulse=0.02, rate_gain=k)
    rows, total = fly(flown, side * 5.6e-3, 0.0, 48.0, push=side * d)
    pulses = rows[np.flatnonzero(np.diff(np.abs(rows[:, 3])) > 0.0) + 1, 0]
    assert np.diff(pulses) == pytest.approx(dv / d, rel=0.01)
    swing = np.ptp(rows[rows[:, 0] > pulses[1], 1])
    assert swing == pytest.approx(dv**2 / (8.0 * d), rel=0.02)  # 0.4 % of it in a period
    assert total[1 if side < 0.0 else 0] == 0.0


SLOW: dict[str, Any] = {**PLANT, "control_period": 0.1, "inner_period": 0.1}
EVERY = [
    laws.Centre(**SLOW),
    laws.Sliding(**SLOW),
    laws.MinimumTime(**SLOW),
    laws.MinimumFuel(**SLOW, final_time=100.0),
    laws.Schmitt(**SLOW, threshold=0.1, hysteresis=0.02, rate_gain=1.0),
    laws.MinimumImpulse(**SLOW, dead_zone=0.1, pulse=0.25),
]


@pytest.mark.parametrize("flown", EVERY, ids=lambda law: type(law).__name__)
def test_a_batch_is_its_vehicles_and_a_step_changes_nothing(flown: Any) -> None:
    random = np.random.default_rng(5)
    turned = att.from_rotation_vector(random.uniform(-0.4, 0.4, (4, 3)))
    many = Measurement(
        attitude=turned, rate=random.uniform(0.0, 1e-3, (4, 3)), wheel_speed=np.zeros((4, 0))
    )
    for array in many._asdict().values():
        array.flags.writeable = False
    state = flown.reset(many, HOLD)
    for k in range(4):
        other = Measurement(attitude=-many.attitude, rate=many.rate, wheel_speed=many.wheel_speed)
        _, aim, signals = flown.step(state, 0.1 * k, many, HOLD)
        after, command = flown.inner(state, 0.1 * k, aim, many)
        np.testing.assert_array_equal(command.on_time, aim.on_time)
        _, same = flown.inner(state, 0.1 * k, aim, other)
        np.testing.assert_array_equal(command.on_time, same.on_time)
        for i in range(4):
            one = many._map(itemgetter(i))
            alone = State(state.memory[i])
            _, aim_of_one, shown = flown.step(alone, 0.1 * k, one, HOLD)
            _, pulses = flown.inner(alone, 0.1 * k, aim_of_one, one)
            np.testing.assert_array_equal(command.on_time[i], pulses.on_time)
            np.testing.assert_array_equal(signals.firing[i], shown.firing)
        state = after
    assert (command.on_time >= 0.0).all()
    assert (command.on_time <= 0.1).all()


def test_a_turn_is_what_attitude_algebra_says() -> None:
    random = np.random.default_rng(0)
    seen_, wanted = att.normalize(random.normal(size=(2, 50, 4)))
    rate, wanted_rate = random.normal(size=(2, 50, 3))
    angle, slip = turn(
        Measurement(attitude=seen_, rate=rate, wheel_speed=NONE),
        Reference(wanted, wanted_rate, NONE),
        np.eye(3),
    )
    error = att.multiply(att.conjugate(wanted), seen_)
    np.testing.assert_allclose(angle, att.to_rotation_vector(error), atol=1e-14)
    np.testing.assert_allclose(
        slip, rate - att.rotate(att.conjugate(error), wanted_rate), atol=1e-14
    )


def test_what_no_law_can_use_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"hysteresis: got 0\.02 rad, should be less than threshold"
    ):
        law(laws.Schmitt, threshold=0.01, hysteresis=0.02, rate_gain=1.0)
    weak = PLANT | {"thruster_force": np.array([*[0.5] * 6, *[0.4] * 6])}
    with pytest.raises(ValueError, match=r"\[0.5\] N m and \[-0.4\] N m"):
        laws.Centre(**weak, axes=Y[None], control_period=0.1, inner_period=0.1)
