"""The cascade of the double-gimbal CMG: its own arithmetic; that it flies is shown on the plant."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from dgvscmg_samples import AT_REST, RATES, measured
from mjspace.controllers.cmg.dgvscmg import Cascade, State
from mjspace.controllers.cmg.steering import carried
from mjspace.controllers.motors.motor_loops import held_current

from mjspace.contract import Measurement


def cascade(**gains: Any) -> Cascade:
    return Cascade(**RATES | gains)


def flown(law: Cascade, measurement: Measurement) -> tuple[State, Any, Any, Any]:
    state = law.reset(measurement, AT_REST)
    state, command, signals = law.step(state, 0.0, measurement, AT_REST)
    for k in range(3):
        state, voltage = law.inner(state, k * 1e-4, command, measurement)
    return state, command, signals, voltage


def test_nothing_is_asked_of_a_satellite_that_is_where_it_should_be() -> None:
    q = np.array([[1.0, 0.0, 0.0, 0.0]])
    none = np.zeros((1, 2))
    still = Measurement(
        attitude=q,
        rate=np.zeros((1, 3)),
        wheel_speed=np.full((1, 1), 73.0),
        gimbal_angle=none,
        gimbal_rate=none,
        current=np.zeros((1, 3, 2)),
    )
    _, command, signals, voltage = flown(cascade(), still)
    for asked in (*command, signals.sigma_e, signals.s, signals.torque, signals.speed_error):
        np.testing.assert_allclose(asked, 0.0, atol=1e-15)
    # the wheel's motor holds its back-EMF, k_m W, and nothing else
    np.testing.assert_allclose(voltage.voltage[0], [[0, 0], [0, 0], [0, 2.0 * 73.0]], atol=1e-9)


def test_the_wheel_s_wanted_speed_is_the_integral_of_what_the_steering_wants() -> None:
    measurement = measured(2)
    state, command, *_ = flown(cascade(), measurement)
    # about its axis: with what the bus and the outer gimbal turn there
    with_carrier = (
        measurement.wheel_speed
        + carried(measurement.rate, measurement.gimbal_angle, measurement.gimbal_rate)[..., 2:]
    )
    wanted = with_carrier + 3e-4 * command.acceleration[:, 2:]
    np.testing.assert_allclose(state.desired_wheel_speed, wanted, rtol=1e-14)


def test_a_slower_speed_loop_holds_the_currents_that_it_wants() -> None:
    """Every fifth inner period, told by the time alone: any period is a start."""
    law, measurement = cascade(speed_steps=5), measured(2)
    state = law.reset(measurement, AT_REST)
    _, command, _ = law.step(state, 0.0, measurement, AT_REST)
    changed = []
    for k in range(100, 115):
        before = state
        state, _ = law.inner(before, k * 1e-4, command, measurement)
        changed.append(np.any(state.speed_memory != before.speed_memory))
        assert np.any(state.voltage_integral != before.voltage_integral)
    assert np.flatnonzero(changed).tolist() == [0, 5, 10]
    gained = state.desired_wheel_speed - law.reset(measurement, AT_REST).desired_wheel_speed
    np.testing.assert_allclose(gained, 1.5e-3 * command.acceleration[:, 2:], rtol=1e-11)


@pytest.mark.parametrize("steps", [1, 5])
def test_it_feeds_the_vibration_back_as_far_ahead_as_its_current_loop_lags(steps: int) -> None:
    one = np.ones(3)
    law = cascade(
        speed_steps=steps, vibration_gain=5.0 * one, observer_gain=one, adaptation_gain=one
    )
    lag = 1.0 / law.current_gain + 0.5 * (steps - 1) * law.inner_period
    assert lag > 1e-4
    state, command, _, _ = flown(law, measured(1))
    random = np.random.default_rng(3)
    memory = np.abs(random.normal(size=state.speed_memory.shape))  # a vibration is believed in
    speed, current = 30.0 + random.normal(size=(1, 3)), random.normal(size=(1, 3, 2))
    right, late, flying = (
        held_current(
            loop.step(
                memory, current, speed, speed, command.acceleration, command.load, 0.0 * speed
            )[0]
        )
        for loop in (
            replace(law._speed_loop, lead=lag),
            replace(law._speed_loop, lead=0.0),
            law._speed_loop,
        )
    )
    np.testing.assert_array_equal(flying, right)
    assert np.abs(late - right).max() > 1e-3  # A


def test_limits_hold_whatever_is_measured() -> None:
    gains = {"gimbal_rate_limit": 2.0, "wheel_acceleration_limit": 30.0}
    law = cascade(**gains, current_limit=np.array([3.0, 3.0, 0.2]))
    measurement = measured(200)._replace(wheel_speed=np.linspace(-3.0, 3.0, 201)[:-1, None])
    state, command, *_ = flown(law, measurement)
    assert np.abs(command.gimbal_rate).max() == pytest.approx(2.0)
    assert np.abs(command.acceleration).max() == pytest.approx(30.0)
    asked = np.abs(held_current(state.speed_memory))
    np.testing.assert_allclose(asked.max(axis=0), [3.0, 3.0, 0.2])


def test_the_thesis_leaves_the_gyroscopic_torque_out() -> None:
    measurement = measured(1)
    _, told, *_ = flown(cascade(), measurement)
    _, untold, *_ = flown(cascade(gyroscopic_feedforward=0.0), measurement)
    assert np.abs(told.load[0, :2]).min() > 0.1
    np.testing.assert_array_equal(untold.load, 0.0)


@pytest.mark.parametrize(
    ("gains", "message"),
    [
        ({"current_gain": 9e6}, "control period of 0.0001 s is too long"),  # erratum E21
        ({"speed_gain": np.array([2.0, 2.0, 500.0])}, "pole"),
        ({"speed_steps": 5, "speed_gain": np.array([2.0, 2.0, 100.0])}, r"period of 0\.0005 s"),
        ({"speed_steps": 3}, "speed_steps"),
    ],
)
def test_gains_that_the_period_cannot_bear_are_refused(gains: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        cascade(**gains)
