"""Laws that use the Earth's field: what they take from a tumble and from wheels, and what not."""

from operator import itemgetter

import numpy as np
import pytest
from mjspace.controllers.attitude.linear_quadratic import Regulator
from mjspace.controllers.magnetic.magnetic import BDot, MagneticUnloading
from mjspace.controllers.thrusters.thruster_unloading import ThrusterUnloading

from mjspace import attitude
from mjspace.contract import Array, Measurement, Reference

INERTIA, AXES, JW = np.diag([10.0, 12.0, 14.0]), np.eye(3), np.full(3, 0.05)
REST = Reference(np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3))
FIELD = np.array([2e-5, -3e-5, 1e-5])


def readings(count: int = 5) -> Measurement:
    rng = np.random.default_rng(4)
    turned = attitude.from_rotation_vector(0.02 * rng.normal(size=(count, 3)))
    fields = FIELD * rng.uniform(0.5, 1.5, size=(count, 3))
    rate, speed = 0.01 * rng.normal(size=(count, 3)), 100.0 * rng.normal(size=(count, 3))
    return Measurement(attitude=turned, rate=rate, wheel_speed=speed, magnetic_field=fields)


def test_b_dot_brakes_what_turns_across_the_field() -> None:
    law, period = BDot(2e6, 0.1), 0.1
    w = np.array([0.03, 0.02, -0.025])
    ahead = attitude.from_rotation_vector(w * period)
    later = attitude.rotate(attitude.conjugate(ahead), FIELD)

    def seen(field: Array) -> Measurement:
        return readings(1)._replace(magnetic_field=field[None])

    state = law.reset(seen(FIELD), REST)
    state, command, _ = law.step(state, 0.0, seen(FIELD), REST)
    np.testing.assert_array_equal(command.dipole, 0.0)
    state, command, shown = law.step(state, period, seen(later), REST)
    np.testing.assert_array_equal(state.field[0], later)
    # dB/dt = -w x B in body axes; to the first order in w T / 2 = 2e-3
    np.testing.assert_allclose(shown.field_rate[0], np.cross(FIELD, w), atol=5e-3 * 1.5e-6)
    torque = np.cross(command.dipole[0], later)
    wanted = -2e6 * (FIELD @ FIELD * w - FIELD * (FIELD @ w))
    np.testing.assert_allclose(torque, wanted, atol=5e-3 * np.abs(wanted).max())
    assert torque @ w < 0.0


BIAS = np.array([2.0, -1.0, 3.0])


@pytest.mark.parametrize("desired", [np.zeros(3), BIAS])
def test_magnetic_unloading_takes_what_is_across_the_field(desired: Array) -> None:
    gains = {"unloading_gain": 1e-3, "desired_momentum": desired}
    law, seen = MagneticUnloading(INERTIA, AXES, JW, **gains), readings()
    _, command, shown = law.step(law.reset(seen, REST), 0.0, seen, REST)
    h, B = shown.h, seen.magnetic_field
    # absolute, about the wheels' axes
    np.testing.assert_allclose(h, 0.05 * (seen.wheel_speed + seen.rate), rtol=1e-14)
    given = np.cross(command.dipole, B)
    unit = attitude.normalize(B)
    excess = h - desired
    across = excess - unit * np.sum(unit * excess, axis=1, keepdims=True)
    np.testing.assert_allclose(given, -1e-3 * across, rtol=1e-11)
    np.testing.assert_allclose(np.sum(command.dipole * B, axis=1), 0.0, atol=1e-18)
    # what acts on the bus in the end is what points it
    plain = Regulator(INERTIA, AXES, JW)
    _, pointing, _ = plain.step(plain.reset(seen, REST), 0.0, seen, REST)
    np.testing.assert_allclose(command.torque + given, pointing.torque, rtol=1e-13)


@pytest.mark.parametrize("desired", [np.zeros(3), BIAS])
@pytest.mark.parametrize("told", [1.0, 0.0])
def test_thrusters_bring_an_exponential_decay(told: float, desired: Array) -> None:
    gains = {"unloading_gain": 0.005, "control_period": 2.0, "desired_momentum": desired}
    law = ThrusterUnloading(INERTIA, AXES, JW, **gains, feed_forward=told)
    seen = readings()
    _, command, shown = law.step(law.reset(seen, REST), 0.0, seen, REST)
    left = shown.h + 2.0 * command.thruster_torque
    np.testing.assert_allclose(left - desired, np.exp(-0.01) * (shown.h - desired), rtol=1e-13)
    plain = Regulator(INERTIA, AXES, JW)
    _, pointing, _ = plain.step(plain.reset(seen, REST), 0.0, seen, REST)
    wheels = command.torque + told * command.thruster_torque
    np.testing.assert_allclose(wheels, pointing.torque, rtol=1e-13)


@pytest.mark.parametrize(
    "law",
    [
        BDot(2e6, 0.1),
        MagneticUnloading(INERTIA, AXES, JW),
        ThrusterUnloading(INERTIA, AXES, JW),
    ],
    ids=lambda law: type(law).__name__,
)
def test_pure_and_alone_as_in_a_batch(law: BDot | MagneticUnloading | ThrusterUnloading) -> None:
    many = readings()
    for array in many._asdict().values():
        array.flags.writeable = False
    state = law.reset(many, REST)
    (once, twice) = (law.step(state, 0.0, many, REST) for _ in range(2))
    for a, b in zip((*once[0], *once[1]), (*twice[0], *twice[1]), strict=True):
        np.testing.assert_array_equal(a, b)
        assert not any(np.shares_memory(a, part) for part in many._asdict().values())
    for i in range(5):
        one = many._map(itemgetter(slice(i, i + 1)))
        _, command, _ = law.step(law.reset(one, REST), 0.0, one, REST)
        for a, b in zip(once[1], command, strict=True):
            np.testing.assert_array_equal(a[i], b[0])
