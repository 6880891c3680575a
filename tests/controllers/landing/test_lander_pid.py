"""The over-actuated lander: each loop's force and torque, by thrusters that push one way each."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mjspace.controllers.landing.descent import SineDescent
from mjspace.controllers.landing.lander_pid import OverActuated
from mjspace.controllers.thrusters.allocation import effect

import mjspace
from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Trajectory

SCENARIO = Path(mjspace.__file__).parent / "scenarios/lander-over-actuated.toml"
RCS: dict[str, Any] = tomllib.loads(SCENARIO.read_text())["plant"]["rcs"]
PLACES, WAYS, FORCE = (np.array(RCS[key], float) for key in ("positions", "directions", "thrust"))
PERIOD, INERTIA = 0.02, np.diag([90.0, 80.0, 100.0])
LAW = OverActuated(
    control_period=PERIOD,
    inertia=INERTIA,
    thruster_positions=PLACES,
    thruster_directions=WAYS,
    thruster_force=FORCE,
)
NOW = SineDescent().at(np.array([50.0]))
DESIRED = Trajectory(*(part[0] for part in NOW))


def seen(
    angle: Any = (0.0, 0.0, 0.0), aside: Any = (0.0, 0.0, 0.0), contact: float = 0.0
) -> Measurement:
    """Return what is measured with these errors: a rotation vector, body axes, and a position."""
    return Measurement(
        attitude=att.multiply(DESIRED.attitude, att.from_rotation_vector(np.array(angle))),
        rate=DESIRED.rate,
        position=DESIRED.position + aside,
        velocity=DESIRED.velocity,
        propellant=np.zeros(2),
        contact=np.array([contact]),
    )


def applied(on_time: Array) -> Array:
    """Return the mean torque and force of a period, (6,)."""
    return effect(PLACES, WAYS, FORCE) @ on_time / PERIOD


def test_there_are_28_thrusters_that_push_every_way() -> None:
    assert len(PLACES) == len(WAYS) == len(FORCE) == 28
    rank = np.linalg.matrix_rank(effect(PLACES, WAYS, FORCE)[:6])
    assert rank == 6
    assert effect(PLACES, WAYS, FORCE).sum(axis=1) == pytest.approx(np.zeros(6), abs=1e-12)


def test_without_errors_the_engine_gives_the_desired_force_and_the_thrusters_hardly_any() -> None:
    _, command, signals = LAW.step(LAW.reset(seen(), DESIRED), 50.0, seen(), DESIRED)
    wanted = DESIRED.linear_acceleration - LAW.gravity(DESIRED.position)
    assert command.thrust[0] == pytest.approx(100.0 * np.linalg.norm(wanted), rel=1e-9)
    assert signals.desired_force == pytest.approx(np.zeros(3), abs=1e-6)
    assert signals.desired_torque == pytest.approx(INERTIA @ DESIRED.acceleration, abs=1e-6)
    assert not command.gimbal.any()


def test_an_error_of_place_is_pushed_back_without_leaning() -> None:
    aside = att.rotate(DESIRED.attitude, np.array([2.0, -1.0, 0.0]))
    at = seen(aside=aside)
    _, command, signals = LAW.step(LAW.reset(at, DESIRED), 50.0, at, DESIRED)
    force = -100.0 * LAW.position_gain * np.array([2.0, -1.0, 0.0])
    assert signals.desired_force == pytest.approx(force, abs=1e-3)
    assert applied(command.on_time) == pytest.approx([0.0, 0.0, 0.0, *force], abs=1e-2)


def test_an_error_of_attitude_is_turned_back_without_a_push() -> None:
    angle = np.array([0.02, -0.03, 0.05])
    at = seen(angle)
    _, command, signals = LAW.step(LAW.reset(at, DESIRED), 50.0, at, DESIRED)
    assert signals.angle_error == pytest.approx(angle, abs=1e-12)
    # 1e-3: the rate of the desired motion, seen from the turned axes
    assert signals.desired_torque == pytest.approx(-INERTIA @ angle, abs=0.02)
    pushed = applied(command.on_time)
    assert pushed[:3] == pytest.approx(signals.desired_torque, abs=1e-9)
    assert pushed[3:] == pytest.approx(signals.desired_force, abs=1e-9)


def test_the_integrals_grow_with_the_errors_up_to_their_reach() -> None:
    at = seen((0.01, 0.5, 0.0), (0.3, 7.0, 0.0))
    state = LAW.reset(at, DESIRED)
    for _ in range(10):
        state = LAW.step(state, 50.0, at, DESIRED)[0]
    angle = LAW.step(state, 50.0, at, DESIRED)[2].angle_error
    expected = 10 * PERIOD * np.clip(angle, -0.02, 0.02)
    assert state.angle_integral == pytest.approx(expected)
    assert state.integral == pytest.approx(10 * PERIOD * np.array([0.3, 1.0, 0.0]))


def test_at_touchdown_everything_is_shut_for_good() -> None:
    at = seen((0.1, 0.0, 0.0), contact=1.0)
    state, command, _ = LAW.step(LAW.reset(at, DESIRED), 50.0, at, DESIRED)
    assert not command.thrust.any()
    assert not command.on_time.any()
    _, command, _ = LAW.step(state, 50.0, seen((0.1, 0.0, 0.0)), DESIRED)
    assert not command.on_time.any()
