"""Sun acquisition: its function of Lyapunov, what it sees and keeps, and its flight, compiled."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from compiled_flights import assembly, assert_same, flown
from mjspace.controllers.missions.sun_acquisition import FACES, State, SunAcquisition

from mjspace import attitude
from mjspace.contract import Array

AXIS = np.array([0.6, 0.0, 0.8])
LAW = SunAcquisition(
    control_period=0.5,
    wheel_axes=np.eye(3),
    wheel_inertia=np.full(3, 0.01),
    axis=AXIS,
    correction=0.2,
)
REFERENCE: Any = None


class Seen(NamedTuple):
    """What the law reads."""

    rate: Array
    wheel_speed: Array
    sun_cosines: Array
    magnetic_field: Array


def readings(count: int = 50) -> tuple[Seen, Array]:
    """Return what ideal sensors report, and where the Sun is, (count, 3)."""
    rng = np.random.default_rng(5)
    sun = attitude.normalize(rng.normal(size=(count, 3)))
    cells = np.maximum(sun @ np.array(FACES).T, 0.0)
    rate, speed = 0.05 * rng.normal(size=(count, 3)), 50.0 * rng.normal(size=(count, 3))
    return Seen(rate, speed, cells, 3e-5 * rng.normal(size=(count, 3))), sun


def test_cells_on_six_sides_have_the_direction() -> None:
    seen, sun = readings()
    state, _, shown = LAW.step(LAW.reset(seen, REFERENCE), 0.0, seen, REFERENCE)
    np.testing.assert_allclose(state.sun, sun, atol=1e-15)
    np.testing.assert_array_equal(shown.lit, 1.0)
    np.testing.assert_allclose(np.cos(shown.sun_angle[:, 0]), sun @ AXIS, atol=1e-14)


def test_the_function_of_lyapunov_falls_by_the_damping_alone() -> None:
    seen, sun = readings()
    _, command, shown = LAW.step(LAW.reset(seen, REFERENCE), 0.0, seen, REFERENCE)
    outside = np.cross(command.dipole, seen.magnetic_field)
    # I w' = torque + m x B - w x (I w) - w x h, whose last but one does no work
    work = seen.rate * (command.torque + outside - np.cross(seen.rate, shown.h))
    # V' = k (1 - a.s)' + w.(I w)', s' = -w x s
    turning = LAW.sun_gain * np.cross(seen.rate, sun) @ AXIS
    expected = -LAW.rate_gain * np.sum(seen.rate**2, axis=1)
    np.testing.assert_allclose(turning + np.sum(work, axis=1), expected, atol=1e-15)


def test_until_it_has_seen_the_sun_it_damps_the_rate() -> None:
    seen, _ = readings()
    dark = seen._replace(sun_cosines=np.full((50, 6), 0.1))
    state, command, shown = LAW.step(LAW.reset(dark, REFERENCE), 0.0, dark, REFERENCE)
    outside = np.cross(command.dipole, dark.magnetic_field)
    np.testing.assert_allclose(
        command.torque + outside + np.cross(shown.h, dark.rate), -1.5 * dark.rate, atol=1e-15
    )
    np.testing.assert_array_equal(state.found, 0.0)


def test_in_the_shadow_the_gyro_turns_what_it_has_seen() -> None:
    seen, sun = readings()
    dark = seen._replace(sun_cosines=np.zeros((50, 6)))
    state = State(sun, np.ones((50, 1)))
    for _ in range(4):
        state, _, shown = LAW.step(state, 0.0, dark, REFERENCE)
    turned = attitude.rotate(attitude.from_rotation_vector(-2.0 * seen.rate), sun)
    np.testing.assert_allclose(state.sun, turned, atol=1e-14)
    np.testing.assert_array_equal(shown.lit, 0.0)


def test_of_a_new_direction_it_takes_a_part() -> None:
    seen, sun = readings(1)
    still = seen._replace(rate=np.zeros((1, 3)))
    aside = attitude.rotate(attitude.from_rotation_vector(np.array([0.0, 0.01, 0.0])), sun)
    off = np.arccos(np.sum(aside * sun))
    state, _, _ = LAW.step(State(aside, np.ones((1, 1))), 0.0, still, REFERENCE)
    # a chord of a small angle: to its square
    assert np.arccos(np.sum(state.sun * sun)) == pytest.approx(0.8 * off, rel=1e-4)


@pytest.mark.usefixtures("short_blocks")
def test_it_flies_compiled() -> None:
    built = assembly(
        "sun-safe-mode",
        "law={kind='sun_acquisition:SunAcquisition',axis=[0,1,0]}",
        *("duration=100", "faults=[]", "events=[]", "initial.rate=[0.02,0.05,-0.03]"),
    )
    compiled = flown(built, (0, 1))
    assert "law" in compiled.compiled
    assert "Python" not in compiled.compiled
    assert_same(compiled, flown(built, (0, 1), compiled=False))
