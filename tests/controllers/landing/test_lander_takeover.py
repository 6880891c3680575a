"""Thrusters first, the engine's gimbals after their failure: who acts, and when it is noticed."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.landing.descent import SineDescent
from mjspace.controllers.landing.lander_takeover import Command, State, Takeover
from mjspace.controllers.landing.lander_vectoring import ThrustVectoring
from mjspace.controllers.thrusters.allocation import effect

from mjspace import attitude as att
from mjspace.contract import Array, Measurement

X, Y, Z = np.eye(3)
PLACES = np.array([Y, -Y, -Y, Y, -X, X, X, -X, X, -X, X, -X])
WAYS = np.array([Z, -Z, Z, -Z, Z, -Z, Z, -Z, Y, -Y, -Y, Y])
FORCE, PERIOD = np.full(12, 10.0), 0.02
INERTIA = np.diag([90.0, 80.0, 100.0])
NOW: Any = SineDescent().at(np.array([50.0]))
DESIRED: Any = type(NOW)(*(part[0] for part in NOW))
LAW = Takeover(
    control_period=PERIOD,
    thruster_positions=PLACES,
    thruster_directions=WAYS,
    thruster_force=FORCE,
)


def seen(rate: Array, contact: float = 0.0) -> Measurement:
    return Measurement(
        attitude=att.multiply(DESIRED.attitude, att.from_rotation_vector(np.full(3, 0.01))),
        rate=rate,
        position=DESIRED.position + 1.0,
        velocity=DESIRED.velocity,
        propellant=np.zeros(0),
        contact=np.array([contact]),
    )


RATE = np.array([0.02, -0.01, 0.03])


def test_the_thrusters_give_the_torque_while_the_gimbals_are_straight() -> None:
    state, command, signals = LAW.step(LAW.reset(seen(RATE), DESIRED), 50.0, seen(RATE), DESIRED)
    given = effect(PLACES, WAYS, FORCE) @ command.on_time / PERIOD
    assert given[:3] == pytest.approx(signals.desired_torque)
    assert given[3:] == pytest.approx(np.zeros(3), abs=1e-12)
    assert not command.gimbal.any()
    assert not state.failed.any()


def test_once_they_have_failed_it_is_thrust_vectoring() -> None:
    own = ThrustVectoring(control_period=PERIOD)
    _, expected, _ = own.step(own.reset(seen(RATE), DESIRED), 50.0, seen(RATE), DESIRED)
    start = LAW.reset(seen(RATE), DESIRED)._replace(failed=np.ones(1))
    _, command, _ = LAW.step(start, 50.0, seen(RATE), DESIRED)
    assert np.array_equal(command.thrust, expected.thrust)
    assert np.array_equal(command.gimbal, expected.gimbal)
    assert not command.on_time.any()


def turned(share: float, periods: int = 60) -> tuple[State, Command, float]:
    """Return the last step of a body on which the thrusters give a share; the largest residual."""
    rate, state, largest = RATE, LAW.reset(seen(RATE), DESIRED), 0.0
    for _ in range(periods):
        state, command, signals = LAW.step(state, 50.0, seen(rate), DESIRED)
        largest = max(largest, float(np.linalg.norm(signals.residual)))
        torque = share * (effect(PLACES, WAYS, FORCE) @ command.on_time)[:3] / PERIOD
        spin = np.linalg.solve(INERTIA, torque - np.cross(rate, INERTIA @ rate))
        rate = rate + PERIOD * spin
    return state, command, largest


def test_a_failure_is_noticed_by_the_residual_and_no_failure_is_not() -> None:
    state, command, residual = turned(1.0)
    assert residual < 1e-9
    assert not state.failed.any()
    state, command, residual = turned(0.0)
    assert residual > LAW.failure_torque
    assert state.failed.all()
    assert not command.on_time.any()


def test_at_touchdown_nothing_fires() -> None:
    down = seen(RATE, contact=1.0)
    state, command, _ = LAW.step(LAW.reset(down, DESIRED), 50.0, down, DESIRED)
    assert not command.on_time.any()
    assert not command.thrust.any()
    assert not state.failed.any()
