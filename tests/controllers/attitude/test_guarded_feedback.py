"""Feedback that outlives sensors: the median of its gyros, and its estimate without a tracker."""

from typing import Any

import numpy as np
from mjspace.controllers.attitude.guarded_feedback import Guarded
from mjspace.controllers.attitude.quaternion_feedback import Switched

from mjspace import attitude
from mjspace.contract import Array, Measurement, Reference

PERIOD, CORRECTION = 0.1, 0.05
GAINS: Any = {
    "control_period": PERIOD,
    "wheel_axes": np.eye(3),
    "wheel_inertia": np.full(3, 0.01),
}
LAW = Guarded(**GAINS, correction=CORRECTION)
REST = Reference(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))


def measured(q: Array, *gyros: Any, valid: float = 1.0) -> Any:
    kind: Any = Measurement._with_sensors(
        {"tracker": "attitude", "gyro_1": "rate", "gyro_2": "rate", "gyro_3": "rate"}
    )
    names = {f"gyro_{k}": np.array(rate, float) for k, rate in enumerate(gyros, 1)}
    return kind(tracker=q, tracker_valid=np.array([valid]), wheel_speed=np.zeros(3), **names)


def test_the_rate_is_the_middle_of_three_on_each_axis() -> None:
    gyros = [9.0, 0.1, -0.2], [0.1, 0.2, -9.0], [0.2, -7.0, -0.3]
    for order in ((0, 1, 2), (2, 0, 1), (1, 0, 2)):
        seen = measured(REST.attitude, *(gyros[k] for k in order))
        _, _, signals = LAW.step(LAW.reset(seen, REST), 0.0, seen, REST)
        assert signals.rate.tolist() == [0.2, 0.1, -0.3]


def test_blinded_it_follows_the_gyros() -> None:
    rate = np.array([0.3, -0.2, 0.1])
    seen = measured(REST.attitude, rate, rate, rate)
    state = LAW.reset(seen, REST)
    blind = measured(REST.attitude, rate, rate, rate, valid=0.0)
    for _ in range(40):
        state, _, signals = LAW.step(state, 0.0, blind, REST)
    np.testing.assert_allclose(
        signals.estimate, attitude.from_rotation_vector(4.0 * rate), atol=1e-14
    )


def test_seeing_it_makes_up_a_part_of_the_difference_in_each_period() -> None:
    at_rest = np.zeros(3)
    state = LAW.reset(measured(REST.attitude, at_rest, at_rest, at_rest), REST)
    off = np.array([2e-4, -1e-4, 3e-4])
    for sign in (1.0, -1.0):  # of the quaternion, which is the same attitude
        seen = measured(sign * attitude.from_rotation_vector(off), at_rest, at_rest, at_rest)
        after = state
        for count in range(1, 60):
            after, _, signals = LAW.step(after, 0.0, seen, REST)
            left = off - attitude.to_rotation_vector(signals.estimate)
            np.testing.assert_allclose(left, (1.0 - CORRECTION) ** count * off, rtol=1e-6)


def test_of_its_estimate_it_is_quaternion_feedback() -> None:
    rate = np.array([0.01, 0.02, -0.03])
    q = attitude.from_rotation_vector(np.array([0.4, 0.1, -0.2]))
    seen = measured(q, rate, rate, rate)
    _, command, signals = LAW.step(LAW.reset(seen, REST), 0.0, seen, REST)
    plain = Switched(**GAINS)
    own = Measurement(attitude=signals.estimate, rate=rate, wheel_speed=np.zeros(3))
    _, expected, _ = plain.step(plain.reset(own, REST), 0.0, own, REST)
    assert command.torque.tolist() == expected.torque.tolist()
