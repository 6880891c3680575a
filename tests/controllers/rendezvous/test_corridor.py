"""The approach up a corridor: forces and torques towards the port, and silence at contact."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.rendezvous.corridor import CorridorApproach, Signals
from mjspace.controllers.thrusters.allocation import effect

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Reference

INERTIA = np.diag([15.0, 12.0, 18.0])
# One each way along each axis, twice over.
PLACES = np.array([
    [-0.4, -0.4, 0], [-0.4, 0.4, 0], [0.4, -0.4, 0], [0.4, 0.4, 0],
    [0, -0.4, -0.5], [0, -0.4, 0.5], [0, 0.4, -0.5], [0, 0.4, 0.5],
    [-0.4, 0, -0.5], [0.4, 0, -0.5], [-0.4, 0, 0.5], [0.4, 0, 0.5],
])  # fmt: skip
WAYS = np.repeat([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], 2, axis=0)
FORCE = np.ones(12)
LAW = CorridorApproach(
    mass=100.0,
    inertia=INERTIA,
    port=np.array([0.6, 0.0, 0.0]),
    thruster_positions=PLACES,
    thruster_directions=WAYS.astype(float),
    thruster_force=FORCE,
    control_period=0.2,
)
NOWHERE: Any = Reference(*(np.zeros(n) for n in (4, 3, 3)))


def seen(**changes: Any) -> Measurement:
    """Return a vehicle at rest on the docking axis, 10 m away, with ``changes``."""
    fields = {
        "rate": np.zeros(3),
        "relative_position": np.array([-10.0, 0.0, 0.0]),
        "relative_attitude": np.array([1.0, 0.0, 0.0, 0.0]),
        "relative_velocity": np.zeros(3),
        "relative_rate": np.zeros(3),
    }
    return Measurement(**(fields | changes))


def stepped(measurement: Measurement, law: CorridorApproach = LAW) -> tuple[Array, Signals]:
    """Return on-times [s] and signals of one step."""
    state = law.reset(measurement, NOWHERE)
    _, command, signals = law.step(state, 0.0, measurement, NOWHERE)
    return command.on_time, signals


def test_at_the_desired_speed_on_the_axis_it_coasts() -> None:
    on_time, signals = stepped(seen(relative_velocity=np.array([0.2, 0.0, 0.0])))
    assert not on_time.any()
    assert signals.closing_speed == pytest.approx(0.2)  # slope 0.02 1/s at 10 m
    assert signals.off_axis == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("distance", "speed"), [(30.0, 0.2), (5.0, 0.1), (0.5, 0.02), (-0.1, 0.02)]
)
def test_the_closing_speed_falls_with_the_distance(distance: float, speed: float) -> None:
    _, signals = stepped(seen(relative_position=np.array([-distance, 0.0, 0.0])))
    assert signals.closing_speed == pytest.approx(speed)
    assert signals.distance == pytest.approx(distance)


def test_force_and_torque_are_those_of_the_thrusters_that_fire() -> None:
    turned = att.from_rotation_vector(np.array([0.02, -0.03, 0.01]))
    on_time, signals = stepped(
        seen(
            relative_position=np.array([-9.0, 0.2, -0.1]),
            relative_attitude=turned,
            relative_velocity=np.array([0.17, 0.002, 0.001]),
        )
    )
    assert signals.off_axis == pytest.approx(np.arctan2(np.hypot(0.2, 0.1), 9.5))
    pulses = effect(PLACES, WAYS.astype(float), FORCE) @ on_time / 0.2
    np.testing.assert_allclose(pulses[:3], signals.torque, atol=1e-12)
    np.testing.assert_allclose(pulses[3:], signals.force, atol=1e-12)
    # Towards the axis and the aligned attitude: w^2 = 0.09 1/s^2 about each body axis.
    towards = att.rotate(turned, signals.force)
    np.testing.assert_allclose(
        towards, 100.0 * np.array([0.16 * 0.01, -0.01 * 0.2, 0.01 * 0.1]) - [0, 0.032, 0.016]
    )
    np.testing.assert_allclose(
        signals.torque, -0.09 * np.diag(INERTIA) * [0.02, -0.03, 0.01], rtol=1e-12
    )


def test_the_velocity_of_the_centre_of_mass_is_controlled() -> None:
    # The port of a vehicle that only turns moves, and its centre does not.
    rate = np.array([0.0, 0.0, 0.1])
    of_port = np.cross(rate, [0.6, 0.0, 0.0])
    _, signals = stepped(
        seen(relative_rate=rate, relative_velocity=of_port + np.array([0.2, 0.0, 0.0]))
    )
    np.testing.assert_allclose(signals.force, 0.0, atol=1e-12)
    assert signals.torque[2] < 0.0


def test_within_reach_of_the_latch_nothing_is_fired() -> None:
    near = np.array([-0.04, 0.01, 0.0])
    on_time, signals = stepped(seen(relative_position=near, relative_rate=np.full(3, 0.01)))
    assert not on_time.any()
    assert not signals.force.any()
    far = np.array([-0.06, 0.01, 0.0])
    assert stepped(seen(relative_position=far, relative_rate=np.full(3, 0.01)))[0].any()
