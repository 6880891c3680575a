"""The cascade of the double-gimbal CMG: its own arithmetic; that it flies is shown on the plant."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.dgvscmg import Cascade, State

from mjspace.contract import Measurement, Reference

BUS = np.array([[10.5, 0.22, 0.47], [0.22, 12.5, 0.36], [0.47, 0.36, 13.6]])
AT_REST = Reference(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))


def cascade(**gains: Any) -> Cascade:
    return Cascade(**{"inertia": BUS, "control_period": 1e-3, "inner_period": 1e-4} | gains)


def seen(vehicles: int, seed: int = 0) -> Measurement:
    random = np.random.default_rng(seed)
    q = random.normal(size=(vehicles, 4))
    return Measurement(
        q / np.linalg.norm(q, axis=1, keepdims=True),
        0.1 * random.normal(size=(vehicles, 3)),
        80.0 + random.normal(size=(vehicles, 1)),
        0.3 * random.normal(size=(vehicles, 2)),
        random.normal(size=(vehicles, 2)),
        random.normal(size=(vehicles, 3, 2)),
    )


def one(arrays: Any, index: int) -> Any:
    return type(arrays)(*(a[index] if a.size else a for a in arrays))


def flown(law: Cascade, measurement: Measurement) -> tuple[State, Any, Any, Any]:
    state = law.reset(measurement, AT_REST)
    state, command, signals = law.step(state, 0.0, measurement, AT_REST)
    for k in range(3):
        state, voltage = law.inner(state, k * 1e-4, command, measurement)
    return state, command, signals, voltage


def test_a_vehicle_is_the_same_alone_and_in_a_batch() -> None:
    law, many = cascade(), seen(6)
    batch = flown(law, many)
    for index in range(6):
        alone = flown(law, one(many, index))
        for a, b in zip(alone, batch, strict=True):
            for x, y in zip(a, one(b, index), strict=True):
                np.testing.assert_array_equal(x, y)


def test_both_quaternions_are_one_attitude() -> None:
    measurement = seen(4)
    turned = measurement._replace(attitude=-measurement.attitude)
    law = cascade()
    np.testing.assert_array_equal(flown(law, turned)[3].voltage, flown(law, measurement)[3].voltage)


def test_nothing_is_asked_of_a_satellite_that_is_where_it_should_be() -> None:
    q = np.array([[1.0, 0.0, 0.0, 0.0]])
    none = np.zeros((1, 2))
    still = Measurement(q, np.zeros((1, 3)), np.full((1, 1), 73.0), none, none, np.zeros((1, 3, 2)))
    _, command, signals, voltage = flown(cascade(), still)
    for asked in (*command, signals.sigma_e, signals.s, signals.torque, signals.speed_error):
        np.testing.assert_allclose(asked, 0.0, atol=1e-15)
    # the wheel's motor holds its back-EMF, k_m W, and nothing else
    np.testing.assert_allclose(voltage.voltage[0], [[0, 0], [0, 0], [0, 2.0 * 73.0]], atol=1e-9)


def test_the_wheel_s_wanted_speed_is_the_integral_of_what_the_steering_wants() -> None:
    measurement = seen(2)
    state, command, *_ = flown(cascade(), measurement)
    wanted = measurement.wheel_speed + 3e-4 * command.acceleration[:, 2:]
    np.testing.assert_allclose(state.wheel_wanted, wanted, rtol=1e-14)


def test_the_thesis_leaves_the_gyroscopic_torque_out() -> None:
    measurement = seen(1)
    _, told, *_ = flown(cascade(), measurement)
    _, untold, *_ = flown(cascade(gyroscopic_feedforward=0.0), measurement)
    assert np.abs(told.load[0, :2]).min() > 0.1
    np.testing.assert_array_equal(untold.load, 0.0)


@pytest.mark.parametrize(
    ("gains", "message"),
    [
        ({"current_gain": 9e6}, "control period of 0.0001 s is too long"),  # erratum E21
        ({"speed_gain": np.array([2.0, 2.0, 500.0])}, "pole"),
    ],
)
def test_gains_that_the_period_cannot_bear_are_refused(gains: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        cascade(**gains)
