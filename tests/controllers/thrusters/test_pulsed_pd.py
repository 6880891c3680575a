"""The pulsed law: the torque of a gyroscopically exact PD, and pulses that give it on average."""

from operator import itemgetter
from typing import Any

import numpy as np
import pytest
from mjspace.controllers.references.references import MultiAxis
from mjspace.controllers.thrusters.allocation import effect
from mjspace.controllers.thrusters.pulsed_pd import PulsedPd, State

from mjspace import attitude as att
from mjspace.contract import Measurement, Reference

INERTIA = np.array([[15.0, 1.0, -0.5], [1.0, 12.0, 0.8], [-0.5, 0.8, 18.0]])
X, Y, Z = np.eye(3)
POSITIONS = np.array([
    [0, 0.4, -0.5], [0, -0.4, 0.5], [0, -0.4, -0.5], [0, 0.4, 0.5],
    [-0.4, 0, 0.5], [0.4, 0, -0.5], [0.4, 0, 0.5], [-0.4, 0, -0.5],
    [0.4, -0.4, 0], [-0.4, 0.4, 0], [-0.4, -0.4, 0], [0.4, 0.4, 0],
])  # fmt: skip
DIRECTIONS = np.array([Z, -Z, Z, -Z, X, -X, -X, X, Y, -Y, Y, -Y])
FORCE, PERIOD = np.full(12, 0.5), 0.1
NOTHING = np.zeros(0)


def law(**gains: Any) -> PulsedPd:
    numbers = {"attitude_gain": 1.2, "rate_gain": 4.8} | gains
    return PulsedPd(INERTIA, POSITIONS, DIRECTIONS, FORCE, PERIOD, **numbers)


def wanted(time: float) -> Reference:
    return Reference(*(part[0] for part in MultiAxis().at(np.array([time]))))


def test_on_its_reference_the_torque_is_what_the_motion_needs() -> None:
    step = 1e-4
    before, now, after = (wanted(3.0 + k * step) for k in (-1, 0, 1))
    seen = Measurement(attitude=now.attitude, rate=now.rate, wheel_speed=NOTHING)
    flown = law()
    _, _, signals = flown.step(flown.reset(seen, now), 0.0, seen, now)
    momenta = [att.rotate(ref.attitude, INERTIA @ ref.rate) for ref in (before, after)]
    change = att.rotate(att.conjugate(now.attitude), (momenta[1] - momenta[0]) / (2.0 * step))
    np.testing.assert_allclose(signals.torque, change, rtol=1e-6)


def test_the_wanted_acceleration_is_seen_from_the_turning_body() -> None:
    step, rate = 1e-4, np.array([0.3, -0.2, 0.1])
    attitude = att.normalize(np.array([0.8, 0.3, -0.4, 0.2]))
    seen_rates = []
    for k in (-1, 1):
        reference = wanted(3.0 + k * step)
        body = att.multiply(attitude, att.from_rotation_vector(k * step * rate))
        inertial = att.rotate(reference.attitude, reference.rate)
        seen_rates.append(att.rotate(att.conjugate(body), inertial))
    acceleration = (seen_rates[1] - seen_rates[0]) / (2.0 * step)
    seen, flown = (
        Measurement(attitude=attitude, rate=rate, wheel_speed=NOTHING),
        law(attitude_gain=0.0, rate_gain=0.0),
    )
    _, _, signals = flown.step(flown.reset(seen, wanted(3.0)), 0.0, seen, wanted(3.0))
    expected = INERTIA @ acceleration + np.cross(rate, INERTIA @ rate)
    np.testing.assert_allclose(signals.torque, expected, rtol=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_it_turns_back_and_brakes(sign: float) -> None:
    turned = att.from_rotation_vector(np.array([0.2, -0.1, 0.3]))
    seen = Measurement(
        attitude=sign * turned, rate=np.array([0.01, 0.02, -0.01]), wheel_speed=NOTHING
    )
    level = Reference(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))
    flown = law()
    _, _, signals = flown.step(flown.reset(seen, level), 0.0, seen, level)
    gyroscopic = np.cross(seen.rate, INERTIA @ seen.rate)
    expected = -1.2 * turned[1:] - 4.8 * seen.rate + gyroscopic
    np.testing.assert_allclose(signals.torque, expected, rtol=1e-12)


def test_pulses_give_the_torque_on_average_and_no_push() -> None:
    turned = att.from_rotation_vector(np.array([0.1, -0.2, 0.15]))
    seen = Measurement(attitude=turned, rate=np.array([0.01, 0.0, -0.01]), wheel_speed=NOTHING)
    level = Reference(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))
    flown = law(thruster_minimum_on=0.03)
    state, total = flown.reset(seen, level), np.zeros(12)
    for _ in range(400):
        state, command, signals = flown.step(state, 0.0, seen, level)
        assert ((command.on_time == 0.0) | (command.on_time >= 0.03)).all()
        total += command.on_time
    mean = effect(POSITIONS, DIRECTIONS, FORCE) @ total / (400 * PERIOD)
    # at most one least pulse of each of six thrusters is still to come
    np.testing.assert_allclose(mean[:3], signals.torque, atol=2 * 0.25 * 0.03 / 40.0)
    np.testing.assert_allclose(mean[3:], 0.0, atol=2 * 0.5 * 0.03 / 40.0)


def test_a_batch_is_its_vehicles() -> None:
    random = np.random.default_rng(1)
    attitude = att.normalize(random.normal(size=(4, 4)))
    seen = Measurement(
        attitude=attitude, rate=random.normal(size=(4, 3)), wheel_speed=np.zeros((4, 0))
    )
    flown = law(thruster_minimum_on=0.02)
    state = State(random.uniform(0.0, 0.02, (4, 12)))
    after, command, signals = flown.step(state, 0.0, seen, wanted(1.0))
    for i in range(4):
        one = seen._map(itemgetter(i))
        after_one, alone, shown = flown.step(State(state.carry[i]), 0.0, one, wanted(1.0))
        np.testing.assert_array_equal(after.carry[i], after_one.carry)
        np.testing.assert_array_equal(command.on_time[i], alone.on_time)
        np.testing.assert_array_equal(signals.torque[i], shown.torque)
