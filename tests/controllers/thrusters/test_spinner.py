"""Spin-up and precession of a spinner: the rhumb line's geometry, and what one pulse does."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.thrusters.spinner import RhumbLine, SpinUp

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Reference

X, Y, Z = np.eye(3)
INERTIA = np.diag([15.0, 15.0, 20.0])
PLANT: dict[str, Any] = {
    "inertia": INERTIA,
    "thruster_positions": np.array([0.4 * X, -0.4 * X, 0.4 * X, -0.4 * X]),
    "thruster_directions": np.array([Y, -Y, Z, -Z]),
    "thruster_force": np.full(4, 4.0),
    "control_period": 0.01,
}
SPIN = 2.0 * np.pi


def rhumb_line(**gains: Any) -> RhumbLine:
    return RhumbLine(**(PLANT | {"torque_axis": -Y, "pulse": 0.2} | gains))


def seen(attitude: Array, spin: float = SPIN) -> Measurement:
    return Measurement(attitude=attitude, rate=spin * Z)


def aimed(vector: Array) -> Reference:
    return Reference(att.from_rotation_vector(vector), np.zeros(3), np.zeros(3))


@pytest.mark.parametrize(
    ("rate", "on_time"), [(0.0, 0.01), (2.999, 20.0 * 0.001 / 3.2), (3.0, 0.0), (3.1, 0.0)]
)
def test_spin_up_fires_what_is_missing(rate: float, on_time: float) -> None:
    law = SpinUp(**PLANT, spin_rate=3.0)
    now = seen(np.array([1.0, 0, 0, 0]), rate)
    _, command, _ = law.step(law.reset(now, aimed(X)), 0.0, now, aimed(X))
    assert command.on_time == pytest.approx([on_time, on_time, 0.0, 0.0], abs=1e-9)


def test_the_plan_is_the_rhumb_line_of_a_sphere() -> None:
    law = rhumb_line()
    # The Sun along x: from z, 90 deg off it, to an axis of another colatitude and azimuth.
    for vector in (np.array([0.3, 0.5, 0.0]), np.array([-0.2, -0.4, 0.0]), np.array([0.5, 0, 0])):
        target = att.rotate(att.from_rotation_vector(vector), Z)
        state = law.reset(seen(np.array([1.0, 0, 0, 0])), aimed(vector))
        length = float(state.left[0] * law.turn_of_a_pulse(np.array([SPIN]))[0])
        # Follow the heading in small steps, with the meridian where the axis is.
        h, steps = Z.copy(), 4000
        for _ in range(steps):
            away = -att.normalize(X - (h @ X) * h)
            ahead = np.cos(state.heading[0]) * away + np.sin(state.heading[0]) * np.cross(h, away)
            h = att.normalize(h + length / steps * ahead)
        off = np.arccos(np.clip(h @ target, -1.0, 1.0))
        # Half a pulse of rounding; Euler's steps.
        assert off < 0.51 * law.turn_of_a_pulse(np.array([SPIN]))[0] + 1e-4


def test_a_pulse_turns_the_momentum_by_its_closed_form_along_the_path() -> None:
    law = rhumb_line(control_period=0.001)
    target = aimed(np.array([0.3, 0.5, 0.0]))
    state = law.reset(seen(np.array([1.0, 0, 0, 0])), target)
    for step in range(1000):
        attitude = att.from_rotation_vector(0.001 * step * SPIN * Z)
        state, command, _ = law.step(state, 0.0, seen(attitude), target)
        if command.on_time.any():
            break
    assert command.on_time == pytest.approx([0.0, 0.0, 0.2, 0.2])
    # The torque of 3.2 N m about -y turns with the body while the pulse lasts.
    time = 0.001 * step + np.linspace(0.0, 0.2, 2001)
    torque = 3.2 * np.stack([np.sin(SPIN * time), -np.cos(SPIN * time), 0.0 * time], axis=-1)
    change = np.trapezoid(torque, time, axis=0) / (20.0 * SPIN)
    turned = float(law.turn_of_a_pulse(np.array([SPIN]))[0])
    assert np.linalg.norm(change) == pytest.approx(turned, rel=1e-6)
    assert turned == pytest.approx(np.radians(0.27298), rel=1e-4)
    # At z, the meridian away from the Sun is along -x.
    heading = np.arctan2(change @ np.cross(Z, -X), change @ -X)
    assert heading == pytest.approx(float(state.heading[0]), abs=0.004)  # half a step of 1 ms


def test_it_fires_once_in_a_revolution_and_as_often_as_planned() -> None:
    law = rhumb_line()
    target = aimed(np.array([0.0, 0.02, 0.0]))
    state = law.reset(seen(np.array([1.0, 0, 0, 0])), target)
    planned = float(state.left[0])
    assert planned == round(0.02 / float(law.turn_of_a_pulse(np.array([SPIN]))[0])) == 4
    fired = []
    for step in range(700):
        attitude = att.from_rotation_vector(0.01 * step * SPIN * Z)
        state, command, _ = law.step(state, 0.0, seen(attitude), target)
        if command.on_time.any():
            fired.append(0.01 * step)
    assert len(fired) == planned
    assert np.diff(fired) == pytest.approx(1.0, abs=0.011)


def test_a_torque_along_the_axis_is_refused() -> None:
    with pytest.raises(ValueError, match=r"torque_axis: got .* should be across the spin axis"):
        rhumb_line(torque_axis=Z)
