"""Speed loops on gimbals and wheels: their limits, and the pyramid of CMGs that they turn."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from mjspace.controllers.cmg.cmg_steering import Cluster, momentum
from mjspace.controllers.cmg.vscmg_cluster import VariableSpeedCommand

from mjspace.actuators.base import Context
from mjspace.actuators.driven_hinges import gimbals_and_wheels
from mjspace.actuators.gimbal_servos import GimbalServos, Servos
from mjspace.contract import Array, GimbalRateCommand, Measurement
from mjspace.errors import FlightError, InputError
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.loading import load
from mjspace.scenario.plant import Initial, Rates
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

STEP = 0.005  # s
QUICK = ["checks=[]", "duration=1", "reference.duration=4"]
NONE = np.zeros((1, 0))


def servos(**table: Any) -> GimbalServos:
    """Return the loops of two CMGs whose motors are gimbal, wheel, gimbal, wheel."""
    driven = gimbals_and_wheels(["a", "a_wheel", "b", "b_wheel"])
    vehicle: Any = SimpleNamespace(driven=driven)  # nothing of it but the hinges matters
    context = Context(vehicle, driven, Rates(), Initial())
    return Servos(**{"wheel_speed": 500.0} | table).actuator(context)


def act(
    flown: GimbalServos, state: Any, wanted: Any, gimbal_rate: Any, wheel_speed: Any
) -> tuple[Any, Array, Array]:
    seen = Measurement(
        attitude=NONE,
        rate=NONE,
        wheel_speed=np.array([wheel_speed]),
        gimbal_angle=np.zeros((1, 2)),
        gimbal_rate=np.array([gimbal_rate]),
    )
    after, torque, cut = flown.act(state, GimbalRateCommand(np.array([wanted])), seen, STEP)
    return after, torque[0], cut[0]


def test_wheels_that_obey_torques_apply_them_within_their_limit() -> None:
    limits = {"wheel_torque_limit": 0.5, "torque_limit": 2.0, "rate_limit": 1.0}
    both, held = servos(**limits, wheels_obey="torque"), servos(**limits)
    command = VariableSpeedCommand(np.array([[0.3, 4.0]]), np.array([[0.2, -0.7]]))
    still = np.zeros((1, 2))
    seen = Measurement(
        attitude=NONE, rate=NONE, wheel_speed=still, gimbal_angle=still, gimbal_rate=still
    )
    after, torque, cut = both.act(both.reset(1), command, seen, STEP)
    np.testing.assert_array_equal(torque[0, 1::2], [0.2, -0.5])  # gimbal, wheel, gimbal, wheel
    np.testing.assert_array_equal(cut[0], [0.0, 0.0, 1.0, 1.0])
    # The gimbals are those of wheels that keep their speed.
    others, expected, _ = held.act(held.reset(1), command, seen, STEP)
    np.testing.assert_array_equal(torque[0, ::2], expected[0, ::2])
    np.testing.assert_array_equal(after["servo_integral"], others["servo_integral"][:, :2])


def flown(overrides: list[str]) -> tuple[Assembly, dict[str, dict[str, Array]]]:
    """Return the assembly of cmg-slew and its rows, of one vehicle."""
    built = assemble(*load("cmg-slew", [*QUICK, *overrides]))
    blocks = list(fly(built, first_start(built, [0])))
    rows = {
        topic: {
            name: np.concatenate([b.rows[topic][name][:, 0] for b in blocks]) for name in fields
        }
        for topic, fields in blocks[0].rows.items()
    }
    return built, rows


def test_each_motor_has_the_torque_of_its_own_loop() -> None:
    loops = servos(rate_gain=2.0, integral_gain=3.0, wheel_gain=0.5, wheel_integral_gain=0.7)
    before = {"servo_integral": np.array([[0.1, 0.2, 0.3, 0.4]])}  # gimbals, then wheels
    after, torque, cut = act(loops, before, [1.0, 2.0], [0.5, 2.5], [498.0, 501.0])
    behind = np.array([0.1 + 0.5 * STEP, 0.2 - 0.5 * STEP, 0.3 + 2.0 * STEP, 0.4 - STEP])
    np.testing.assert_allclose(after["servo_integral"][0], behind, rtol=1e-15)
    gimbals = [2.0 * 0.5 + 3.0 * behind[0], -2.0 * 0.5 + 3.0 * behind[1]]
    wheels = [0.5 * 2.0 + 0.7 * behind[2], -0.5 + 0.7 * behind[3]]
    wanted = [gimbals[0], wheels[0], gimbals[1], wheels[1]]
    np.testing.assert_allclose(torque, wanted, rtol=1e-15)
    assert not cut.any()


def test_limits_cut_and_are_told_and_the_integral_waits() -> None:
    loops = servos(rate_gain=1.0, integral_gain=1.0, rate_limit=2.0, torque_limit=1.5)
    start = loops.reset(1)
    _, torque, cut = act(loops, start, [3.0, -3.0], [1.0, -1.0], [500.0, 500.0])
    np.testing.assert_allclose(torque[::2], [1.0 + STEP, -1.0 - STEP], rtol=1e-15)  # for 2 rad/s
    np.testing.assert_array_equal(cut, [1.0, 0.0, 1.0, 0.0])
    after, torque, cut = act(loops, start, [2.0, 0.5], [0.0, 0.5], [500.0, 500.0])
    np.testing.assert_array_equal(torque[::2], [1.5, 0.0])
    np.testing.assert_array_equal(cut, [1.0, 0.0, 0.0, 0.0])
    np.testing.assert_array_equal(after["servo_integral"], 0.0)
    # wound up, it lets go as soon as the error turns
    full = {"servo_integral": np.array([[5.0, 0.0, 0.0, 0.0]])}
    after, torque, _ = act(loops, full, [1.0, 0.0], [1.5, 0.0], [500.0, 500.0])
    assert torque[0] == 1.5
    assert after["servo_integral"][0, 0] == pytest.approx(5.0 - 0.5 * STEP)


def test_a_law_is_told_the_pyramid_as_it_is_bolted_on() -> None:
    built = assemble(*load("cmg-slew"))
    law: Any = built.law
    skew, turn = np.arccos(1.0 / np.sqrt(3.0)), 0.5 * np.pi * np.arange(4)
    out = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1)
    gimbals = np.sin(skew) * out + np.cos(skew) * np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(law.gimbal_axes, gimbals, atol=1e-15)
    np.testing.assert_allclose(law.spin_axes, np.cross([0.0, 0.0, 1.0], out), atol=1e-15)
    np.testing.assert_allclose(law.wheel_inertia, 0.004, rtol=1e-14)
    np.testing.assert_allclose(law.inertia, np.diag([10.0, 12.0, 14.0]), atol=1e-12)


def test_the_bus_has_the_momentum_that_the_wheels_lost() -> None:
    """The gyrostat's equation, which the simulation does not know: M w + h is constant."""
    built, rows = flown([])
    law: Any = built.law
    truth = rows["/truth"]
    cluster = Cluster(law.gimbal_axes, law.spin_axes, law.wheel_inertia)
    h = momentum(cluster, truth["gimbal_angle"], truth["wheel_speed"])
    of_bus = truth["rate"] @ built.vehicle.inertia
    assert np.linalg.norm(of_bus[-1]) > 1.0
    turned = 0.0059 * truth["gimbal_rate"] @ law.gimbal_axes  # each gimbal with its wheel
    # Across its axis that changes by 1e-4 kg m^2 as it turns, at a rate of 0.1 rad/s.
    np.testing.assert_allclose(of_bus, -h - turned, atol=4e-5)  # 2.1e-5 measured


def test_gimbals_do_as_they_are_told_and_wheels_keep_their_speed() -> None:
    _, rows = flown([])
    wanted, turned = rows["/command"]["gimbal_rate"], rows["/truth"]["gimbal_rate"]
    assert np.abs(turned).max() > 0.5
    # One step of 10 ms, and the torque w x h, which grows, with an integral gain of 60 N m/rad.
    assert np.abs(turned[1:] - wanted[:-1])[10:].max() < 0.02
    assert np.abs(rows["/truth"]["wheel_speed"] - 500.0).max() < 0.02  # 8e-3 measured


def test_wheels_come_up_to_speed_with_a_limited_torque() -> None:
    spin_up = ["initial.wheel_speed=[0,0,0,0]", "plant.servos.wheel_speed=20", "duration=2"]
    _, rows = flown([*spin_up, "plant.servos.wheel_torque_limit=0.1", "reference.angle=0"])
    speed = rows["/truth"]["wheel_speed"]
    # 0.1 N m on 0.004 kg m^2 is 25 rad/s^2, relative to a bus that hardly turns.
    np.testing.assert_allclose(speed[40], 10.0, rtol=1e-3)
    assert speed.max() < 21.0
    np.testing.assert_allclose(speed[-1], 20.0, atol=0.2)


def test_alone_or_in_a_batch_the_same_bits() -> None:
    built = assemble(*load("cmg-slew", [*QUICK, "duration=0.1"]))
    alone = list(fly(built, first_start(built, [0])))
    many = list(fly(built, first_start(built, range(3)), range(3), threads=2))
    for name in alone[0].rows["/state"]:
        one = np.concatenate([b.rows["/state"][name] for b in alone])[:, 0]
        batch = np.concatenate([b.rows["/state"][name] for b in many])
        for vehicle in range(3):
            np.testing.assert_array_equal(batch[:, vehicle], one)


def test_a_log_is_flown_again_bit_for_bit(tmp_path: Path) -> None:
    path = run("cmg-slew", overrides=[*QUICK, "duration=0.1"], out=tmp_path).path
    assert verify(path) is None
    assert verify(path, start=0.05) is None


def test_what_cannot_fly_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"plant\.servos: wheel_speed: missing, and cmg_0_wheel is"
    ):
        assemble(*load("antenna-slew", ["plant.parts.cmg_0={part='cmg'}"]))
    with pytest.raises(InputError, match=r"plant\.servos: no hinge of the parts has a motor that"):
        assemble(*load("antenna-slew", ["plant.parts={}"]))
    drive = "{pole_pairs=1, resistance=1, inductance=1, torque_constant=1}"
    with pytest.raises(InputError, match="drives and servos are both given: give one"):
        load("cmg-slew", [f"plant.drives.cmg_0_wheel={drive}"])
    message = r"no field 'gimbal_rate': it must be of shape \(\.\.\., 4\) \[rad/s\]"
    with pytest.raises(FlightError, match=message):
        run("cmg-slew", overrides=[*QUICK, "law={kind='coast:Coast'}"], out=tmp_path)
