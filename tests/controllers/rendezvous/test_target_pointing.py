"""Pointing at another spacecraft by what is measured of it: where it turns, and where it rests."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.rendezvous.target_pointing import Signals, TargetPointing

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Reference

AXIS = np.array([0.0, 0.0, 1.0])
NOWHERE: Any = Reference(*(np.zeros(n) for n in (4, 3, 3)))
DRAW = np.random.default_rng(5)


def stepped(
    place: Any, speed: Any, rate: Any, wheels: float = 0.0, **gains: Any
) -> tuple[Array, Signals]:
    """Return the torque [N m] and the signals of one step."""
    law = TargetPointing(wheel_axes=np.eye(3), wheel_inertia=np.full(3, 0.01), axis=AXIS, **gains)
    seen = Measurement(
        rate=np.asarray(rate, float),
        camera_position=np.asarray(place, float),
        camera_velocity=np.asarray(speed, float),
        wheel_speed=np.full(np.shape(rate), wheels),
    )
    _, command, signals = law.step(law.reset(seen, NOWHERE), 0.0, seen, NOWHERE)
    return command.torque, signals


def test_it_turns_the_axis_towards_the_other() -> None:
    torque, signals = stepped([0.0, 3.0, 4.0], np.zeros(3), np.zeros(3), pointing_gain=2.0)
    # about -x, by the sine of the angle
    np.testing.assert_allclose(torque, [-2.0 * 0.6, 0.0, 0.0], atol=1e-15)
    assert signals.pointing_angle == pytest.approx(np.arctan2(3.0, 4.0))
    assert signals.distance == pytest.approx(5.0)
    turned = att.rotate(att.from_rotation_vector(0.1 * torque), AXIS)
    assert turned @ [0.0, 0.6, 0.8] > AXIS @ [0.0, 0.6, 0.8]


def test_it_rests_where_the_body_turns_with_the_line_of_sight() -> None:
    """The other one flies in a straight line; the body turns by its rate, on the axis."""
    place, velocity = 50.0 * AXIS, np.array([0.3, -0.2, 0.7])  # inertial axes are the body's now
    rate = np.cross(place, velocity) / (place @ place)
    seen = velocity - np.cross(rate, place)  # the derivative of the components
    torque, signals = stepped(place, seen, rate)
    np.testing.assert_allclose(torque, 0.0, atol=1e-15)
    np.testing.assert_allclose(signals.line_of_sight_rate, 0.0, atol=1e-15)
    still, _ = stepped(place, velocity, np.zeros(3), rate_gain=4.0)
    np.testing.assert_allclose(still, 4.0 * rate, atol=1e-15)


def test_the_turn_about_the_line_of_sight_is_damped() -> None:
    rate = 0.02 * AXIS
    torque, _ = stepped(10.0 * AXIS, np.zeros(3), rate, rate_gain=3.0)
    np.testing.assert_allclose(torque, -3.0 * rate, atol=1e-15)


def test_the_wheels_gyroscopic_torque_is_cancelled() -> None:
    rate = np.array([0.01, 0.02, 0.0])
    place = 10.0 * AXIS
    seen = -np.cross(rate, place)
    without, _ = stepped(place, seen, rate)
    spun, _ = stepped(place, seen, rate, wheels=100.0)
    momentum = 0.01 * (100.0 + rate)  # absolute
    np.testing.assert_allclose(spun - without, np.cross(rate, momentum - 0.01 * rate), atol=1e-15)


def test_a_batch_is_each_of_its_vehicles() -> None:
    place, speed, rate = DRAW.normal(size=(3, 4, 3))
    together, _ = stepped(place, speed, rate)
    alone = [stepped(*row)[0] for row in zip(place, speed, rate, strict=True)]
    np.testing.assert_array_equal(together, alone)
