"""The Earth horizon sensor against the geometry of the orbit."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjspace import attitude
from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.scenario.loading import load
from mjspace.sensors.base import Motion, Surroundings
from mjspace.sensors.horizon import HorizonSensor
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

ORBIT = np.array([7.0e6, 0.0, 0.0])  # m
ORBITING = (
    *("duration='3 s'", "checks=[]", "events=[]"),
    *("environment.orbit.semi_major_axis='7000 km'", "environment.orbit.inclination='50 deg'"),
)


def motion(turned: Array, position: Array) -> Motion:
    surroundings = Surroundings(orbit_position=lambda time: np.broadcast_to(ORBIT, (len(time), 3)))
    still = np.zeros((len(turned), 3))
    return Motion(np.zeros(len(turned)), turned, still, still[:, :0], position, still, surroundings)


def sensor(**table: Any) -> HorizonSensor:
    return HorizonSensor.model_validate(table)


def test_it_points_to_the_centre_in_body_axes() -> None:
    turned = attitude.from_rotation_vector(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.3]]))
    beside = np.array([[0.0, 0.0, 0.0], [0.0, 7.0e6, 0.0]])  # the second is 45 deg ahead
    nadir = sensor().true_value(motion(turned, beside))
    # A body that is turned by 0.3 rad about z finds the centre turned back by as much.
    angle = np.pi + np.pi / 4 - 0.3
    expected = [[-1.0, 0.0, 0.0], [np.cos(angle), np.sin(angle), 0.0]]
    np.testing.assert_allclose(nadir, expected, atol=1e-15)


@pytest.mark.parametrize(("angle", "in_view"), [(0.0, True), (0.49, True), (0.51, False)])
@pytest.mark.parametrize("boresight", [[0.0, 0.0, 1.0], [0.0, -3.0, 4.0]])
def test_it_reports_zeros_out_of_view(boresight: list[float], angle: float, in_view: bool) -> None:
    limited = sensor(field_of_view=0.5, boresight=boresight)
    axis = np.array(boresight) / np.linalg.norm(boresight)
    turn = attitude.from_rotation_vector(angle * np.array([1.0, 0.0, 0.0]))
    value = attitude.rotate(turn, axis)[None]
    reported = limited.with_error(value, np.zeros((1, 3)))
    np.testing.assert_allclose(reported, value if in_view else [[0.0] * 3], atol=1e-15)
    assert limited.errs
    assert not sensor().errs


def test_its_errors_are_rotations_of_the_direction() -> None:
    nadir = np.array([[0.0, 0.0, 1.0]])
    error = np.array([[1e-3, -2e-3, 0.5]])
    tilted = sensor().with_error(nadir, error)
    turn = attitude.from_rotation_vector(error)
    np.testing.assert_allclose(tilted, attitude.rotate(turn, nadir), atol=1e-15)
    about_itself = sensor().with_error(nadir, np.array([[0.0, 0.0, 0.5]]))
    np.testing.assert_allclose(about_itself, nadir, atol=1e-15)
    # to first order (e_y, -e_x, 1)
    small = sensor().with_error(nadir, np.array([[1e-3, -2e-3, 0.0]]))
    np.testing.assert_allclose(small, [[-2e-3, -1e-3, 1.0]], atol=3e-6)  # (2e-3)^2
    digits = sensor(quantization=0.01).with_error(nadir, np.array([[1.4e-2, 0.0, 0.0]]))
    np.testing.assert_allclose(digits, np.array([[0.0, -1.0, 100.0]]) / np.hypot(1, 100))


def test_in_flight_it_measures_the_true_nadir_with_its_noise() -> None:
    noisy = "sensors.horizon={measures='nadir', noise_std='0.1 deg'}"
    built = assemble(
        *load("detumble-wheels", [*ORBITING, noisy, "sensors.second={measures='nadir'}"])
    )
    rows = [block.rows for block in fly(built, first_start(built, [0]))]
    measured, exact, true = (
        np.concatenate([r[topic][name][:, 0] for r in rows])
        for topic, name in (
            *(("/measurement", "horizon"), ("/measurement", "second"), ("/truth", "nadir")),
        )
    )
    quaternion = np.concatenate([r["/truth"]["attitude"][:, 0] for r in rows])
    time = np.concatenate([r["/state"]["physics"][:, 0, 0] for r in rows])
    # a circular orbit by its own formula: the node along x, so that it goes up at 50 deg
    argument = np.sqrt(3.986004418e14 / 7.0e6**3) * time
    across = np.array([0.0, np.cos(np.radians(50.0)), np.sin(np.radians(50.0))])
    up = np.cos(argument)[:, None] * [1.0, 0.0, 0.0] + np.sin(argument)[:, None] * across
    expected = attitude.rotate(attitude.conjugate(quaternion), -up)
    np.testing.assert_allclose(true, expected, atol=1e-9)
    assert np.array_equal(exact, true)
    off = np.linalg.norm(np.cross(measured, true), axis=1)
    # two axes of 0.1 deg each: sqrt(2) times as much, RMS
    assert np.sqrt(np.mean(off**2)) == pytest.approx(np.radians(0.1) * np.sqrt(2.0), rel=0.15)


@pytest.mark.parametrize("orbit", [[], ["environment.orbit={semi_major_axis=2e6,body='moon'}"]])
def test_it_needs_an_orbit_round_the_earth(orbit: list[str], tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"sensors\.horizon: needs an \[environment\.orbit\]"):
        load("detumble-wheels", ["sensors.horizon.measures=nadir", *orbit])
