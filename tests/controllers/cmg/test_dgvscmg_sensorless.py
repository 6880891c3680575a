"""The cascade without sensors on its wheel: what it may not know, and what it finds out."""

from typing import Any

import numpy as np
import pytest
from dgvscmg_samples import AT_REST, RATES, measured
from mjspace.controllers.cmg.dgvscmg import Cascade
from mjspace.controllers.cmg.dgvscmg_sensorless import Sensorless
from mjspace.controllers.motors.sensorless import turned

from mjspace.contract import Array, Measurement
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly


def flown(law: Any, measurement: Measurement) -> list[Any]:
    state = law.reset(measurement, AT_REST)
    state, command, signals = law.step(state, 0.0, measurement, AT_REST)
    for k in range(5):
        state, voltage = law.inner(state, k * 1e-4, command, measurement)
    return [*state, *command, *signals, *voltage]


def test_nothing_comes_of_the_wheel_s_sensors() -> None:
    whole = measured(3, wheel_speed=73.0)
    blind = whole._replace(wheel_speed=np.full((3, 1), np.nan), wheel_angle=np.full((3, 1), 9.0))
    law = Sensorless(**RATES)
    for a, b in zip(flown(law, whole), flown(law, blind), strict=True):
        np.testing.assert_array_equal(a, b)
        assert np.isfinite(a).all()


def test_with_the_right_beliefs_it_does_what_the_cascade_does() -> None:
    """No current, angle zero, the speed believed: the same voltages, one set on windings."""
    still = measured(2, wheel_speed=73.0)._replace(
        wheel_speed=np.full((2, 1), 73.0), current=np.zeros((2, 3, 2)), gimbal_rate=np.zeros((2, 2))
    )
    sensed, law = Cascade(**RATES), Sensorless(**RATES)
    state, command, _ = sensed.step(sensed.reset(still, AT_REST), 0.0, still, AT_REST)
    _, wanted = sensed.inner(state, 0.0, command, still)
    state, same, _ = law.step(law.reset(still, AT_REST), 0.0, still, AT_REST)
    for a, b in zip(same, command, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-14)
    after, given = law.inner(state, 0.0, command, still)
    np.testing.assert_allclose(given.voltage[:, :2], wanted.voltage[:, :2], rtol=1e-14)
    # one period later the rotor has turned by p W T = 0.0438 rad, and holds for the next
    angle, swept = after.observer[..., 4], 6 * 73.0 * 1e-4
    np.testing.assert_allclose(angle, swept, atol=1e-5)  # 3e-6 measured
    back = turned(given.voltage[:, 2:], -(angle + 0.5 * swept)) * np.sinc(0.5 * swept / np.pi)
    # 5e-4 V, of some 90
    np.testing.assert_allclose(back, wanted.voltage[:, 2:], atol=2e-3)


def test_the_observer_is_told_of_the_voltage_that_the_supply_gives() -> None:
    state = flown(Sensorless(**RATES, voltage_limit=50.0), measured(3, wheel_speed=73.0))
    voltage, applied = state[4], state[-1]
    np.testing.assert_allclose(np.hypot(*voltage[:, 0].T), 50.0, rtol=1e-14)
    np.testing.assert_array_equal(applied[:, 2:], voltage)


@pytest.fixture(scope="module")
def quarter_second() -> dict[str, Array]:
    built = assemble(*load("dgvscmg-sensorless", ["duration=0.25", "checks=[]"]))
    blocks = [b.rows for b in fly(built, first_start(built, [0]))]
    return {
        f"{topic}.{name}": np.concatenate([rows[topic][name][:, 0] for rows in blocks])
        for topic in blocks[0]
        for name in blocks[0][topic]
    }


def test_it_finds_the_wheel_s_speed_and_angle(quarter_second: dict[str, Array]) -> None:
    rows, late = quarter_second, slice(100, None)
    speed = rows["/truth.wheel_speed"]
    believed, angle = rows["/state.law_observer"][..., 5], rows["/state.law_observer"][..., 4]
    assert abs(believed[0, 0] - speed[0, 0]) == 3.0
    # What is believed is of one period earlier, and the wheel accelerates by up to 150 rad/s^2.
    assert np.abs(believed - speed)[late].max() < 0.03
    off = np.angle(np.exp(1j * (angle + 6e-4 * speed - 6.0 * rows["/truth.wheel_angle"])))
    assert abs(off[0, 0]) > 0.25
    assert np.abs(off)[late].max() < 1e-3


def test_its_currents_are_the_windings(quarter_second: dict[str, Array]) -> None:
    rows = quarter_second
    angle, current = rows["/truth.wheel_angle"], rows["/truth.current"]
    there = turned(current[:, 2:], -6.0 * angle)[200:, 0]
    # the d current of the true rotor's axes is small, since the believed angle is right
    assert np.abs(there[:, 0]).max() < 0.05 * np.abs(there[:, 1]).max()
    assert np.abs(current[200:, 2, 0]).max() > 0.5 * np.abs(there[:, 1]).max()


def test_a_wrong_angle_hurts() -> None:
    """With the rotor a third of an electrical turn from where it is believed."""
    built = assemble(
        *load(
            "dgvscmg-sensorless",
            ["duration=0.01", "checks=[]", "initial.joint_position.cmg_wheel=0.35"],
        )
    )
    blocks = fly(built, first_start(built, [0]))
    current = np.concatenate([b.rows["/truth"]["current"][:, 0, 2] for b in blocks])
    assert np.hypot(*current.T).max() > 20.0
