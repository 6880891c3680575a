"""Pointing by coils: what is across the field, a closed form over the poles, a wheel's bias."""

from operator import itemgetter
from pathlib import Path

import numpy as np
import pytest
from compiled_flights import flown
from mjspace.controllers.magnetic.magnetic_pointing import (
    MagneticPointing,
    MomentumBias,
    moment_for,
)

from mjspace import attitude
from mjspace.contract import Measurement, Reference
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble

REST = Reference(np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3))
TURN = Reference(np.array([0.8, 0.6, 0, 0]), np.array([0, 0, 1e-3]), np.zeros(3))
AXIS = np.array([0.0, 0.6, 0.8])
COILS = MagneticPointing(2e-3, 0.5)
BIASED = MomentumBias(AXIS[None], np.array([0.01]), 5.0 * AXIS, 4.0, 0.1, 1.0, 2e-3, 0.5, 1e-3)


def readings(count: int = 5) -> Measurement:
    rng = np.random.default_rng(7)
    return Measurement(
        attitude=attitude.from_rotation_vector(0.3 * rng.normal(size=(count, 3))),
        rate=0.01 * rng.normal(size=(count, 3)),
        wheel_speed=300.0 + 100.0 * rng.normal(size=(count, 1)),
        magnetic_field=3e-5 * rng.normal(size=(count, 3)),
    )


def test_a_moment_gives_what_is_across_the_field() -> None:
    rng = np.random.default_rng(2)
    u, field = 1e-4 * rng.normal(size=(20, 3)), 3e-5 * rng.normal(size=(20, 3))
    moment, lost = moment_for(u, field)
    unit = attitude.normalize(field)
    along = np.sum(unit * u, axis=1, keepdims=True)
    np.testing.assert_allclose(lost, along, rtol=1e-12)
    np.testing.assert_allclose(np.cross(moment, field), u - unit * along, atol=1e-18)
    np.testing.assert_allclose(np.sum(moment * field, axis=1), 0.0, atol=1e-18)


def test_coils_are_asked_for_attitude_and_rate() -> None:
    seen = readings()
    _, command, shown = COILS.step(COILS.reset(seen, TURN), 0.0, seen, TURN)
    error = attitude.multiply(attitude.conjugate(TURN.attitude), seen.attitude)
    error = np.where(error[:, :1] < 0.0, -error, error)
    desired = attitude.rotate(attitude.conjugate(error), TURN.rate)
    np.testing.assert_allclose(
        shown.asked, -2e-3 * error[:, 1:] - 0.5 * (seen.rate - desired), rtol=1e-12
    )
    np.testing.assert_array_equal(command.dipole, moment_for(shown.asked, seen.magnetic_field)[0])
    other = seen._replace(attitude=-seen.attitude)
    np.testing.assert_array_equal(COILS.step((), 0.0, other, TURN)[1].dipole, command.dipole)


def test_a_wheel_takes_pitch_and_the_coils_the_rest() -> None:
    seen = readings()
    _, command, shown = BIASED.step(BIASED.reset(seen, REST), 0.0, seen, REST)
    turn, rate = seen.attitude[:, 1:] * np.sign(seen.attitude[:, :1]), seen.rate
    about = -(0.1 * turn + rate) @ AXIS
    np.testing.assert_allclose(command.torque, about[:, None] * AXIS, rtol=1e-12)
    momentum = 0.01 * (seen.wheel_speed[:, 0] + rate @ AXIS)
    np.testing.assert_allclose(shown.momentum[:, 0], momentum, rtol=1e-12)
    np.testing.assert_allclose(shown.asked @ AXIS, -1e-3 * (momentum - 4.0), rtol=1e-9)
    across = np.eye(3) - np.outer(AXIS, AXIS)
    np.testing.assert_allclose(
        shown.asked @ across, -(2e-3 * turn + 0.5 * rate) @ across, atol=1e-16
    )
    still = seen._replace(
        attitude=np.tile(REST.attitude, (5, 1)), rate=0.0 * rate, wheel_speed=np.full((5, 1), 400.0)
    )
    _, nothing, _ = BIASED.step((), 0.0, still, REST)
    np.testing.assert_allclose(nothing.torque, 0.0, atol=1e-18)
    np.testing.assert_allclose(nothing.dipole, 0.0, atol=1e-10)


@pytest.mark.parametrize("law", [COILS, BIASED], ids=["coils", "bias"])
def test_pure_and_alone_as_in_a_batch(law: MagneticPointing | MomentumBias) -> None:
    many = readings()
    for array in many._asdict().values():
        array.flags.writeable = False
    _, command, shown = law.step(law.reset(many, TURN), 0.0, many, TURN)
    for i in range(5):
        one = many._map(itemgetter(slice(i, i + 1)))
        _, alone, told = law.step(law.reset(one, TURN), 0.0, one, TURN)
        for a, b in zip((*command, *shown), (*alone, *told), strict=True):
            np.testing.assert_array_equal(a[i], b[0])


POLAR = """
description = "A ball over the poles of an untilted dipole turns about the orbit's normal"
duration = "4000 s"
[rates]
physics = "1 s"
control = "1 s"
[plant]
gyrostat_inertia = [[10, 0, 0], [0, 10, 0], [0, 0, 10]]
wheels.axes = []
[plant.magnetorquers]
[initial]
rate = [0, 2e-4, 0]
[environment.orbit]
semi_major_axis = "7000 km"
inclination = "90 deg"
[environment.magnetic_field]
tilt = 0
[sensors.magnetic_field]
[reference]
kind = "references:Hold"
[law]
kind = "magnetic_pointing:MagneticPointing"
attitude_gain = 4e-5
rate_gain = 0.02
"""


def test_about_a_polar_orbits_normal_it_is_an_oscillator(tmp_path: Path) -> None:
    (tmp_path / "polar.toml").write_text(POLAR)
    rows = flown(assemble(*load(tmp_path / "polar.toml"))).rows
    time, rate = rows["time"][:, 0], rows["/truth.rate"][:, 0]
    # 10 kg m^2 a'' + 0.02 a' + 4e-5 sin(a / 2) = 0, whose roots are complex; 2 a = sin a to 1e-3
    slow, fast = np.roots([10.0, 0.02, 2e-5])
    expected = (
        2e-4 * (slow * np.exp(slow * time) - fast * np.exp(fast * time)) / (slow - fast)
    ).real
    # a second of delay and the sine: 1e-3 of the largest
    np.testing.assert_allclose(rate[:, 1], expected, atol=4e-7)
    assert np.abs(rate[:, [0, 2]]).max() < 1e-12
