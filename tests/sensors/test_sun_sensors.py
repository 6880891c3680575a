"""Star trackers that are blinded, Sun sensors and satellite navigation against the geometry."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.constants import RADIUS, SUN_RADIUS
from mjspace.environment.shadow import visible_from
from mjspace.errors import InputError
from mjspace.scenario.loading import load
from mjspace.sensors.base import Motion, Surroundings
from mjspace.sensors.gnss import GnssPosition, GnssVelocity
from mjspace.sensors.star_tracker import StarTracker
from mjspace.sensors.sun_sensor import CoarseSunSensor, SunSensor

EARTH = RADIUS["earth"]
PLACE = np.array([0.0, 7.0e6, 0.0])  # m, from the Earth's centre
SUN = np.array([1.5e11, 7.0e6, 0.0])  # m: along x from there
BEHIND = np.array([0.0, -1.5e11, 0.0])  # m: the Earth is between


def motion(turn: Any = (0.0, 0.0, 0.0), sun: Array = SUN, rate: Any = (0.0, 0.0, 0.0)) -> Motion:
    """Return a bus whose axes are turned by a rotation vector [rad] from the inertial ones."""
    around = Surroundings(
        orbit_position=lambda time: np.tile(PLACE, (len(time), 1)),
        orbit_velocity=lambda time: np.tile([7.5e3, 0.0, 0.0], (len(time), 1)),
        sun_position=lambda time: np.tile(sun, (len(time), 1)),
        sunlight=lambda place, sun: visible_from(place, sun, EARTH, SUN_RADIUS),
        planet_radius=EARTH,
    )
    none = np.zeros((1, 3))
    turned = attitude.from_rotation_vector(np.array([turn], float))
    return Motion(np.zeros(1), turned, np.array([rate]), none[:, :0], none, none, around)


def seen(table: dict[str, Any], *where: Any, kind: Any = StarTracker, **other: Any) -> float:
    return float(kind.model_validate(table).validity(motion(*where, **other))[0, 0])


@pytest.mark.parametrize(("angle", "valid"), [(0.49, 0.0), (0.51, 1.0), (-0.49, 0.0), (-0.51, 1.0)])
def test_the_sun_blinds_a_tracker_within_its_exclusion(angle: float, valid: float) -> None:
    table = {"boresight": [2.0, 0.0, 0.0], "sun_exclusion": 0.5}
    assert seen(table, (0.0, angle, 0.0)) == valid
    # behind the Earth it does not
    back = {"boresight": [0.0, -1.0, 0.0], "sun_exclusion": 0.5}
    assert seen(back, (0.0, 0.0, 0.0), BEHIND) == 1.0
    assert seen(back, (0.0, 0.0, 0.0), -BEHIND) == 1.0
    assert seen({"boresight": [0.0, 1.0, 0.0], "sun_exclusion": 0.5}, (0, 0, 0), -BEHIND) == 0.0


@pytest.mark.parametrize(("beyond", "valid"), [(-0.01, 0.0), (0.01, 1.0)])
def test_the_earth_blinds_it_within_an_angle_from_the_limb(beyond: float, valid: float) -> None:
    limb = np.arcsin(EARTH / 7.0e6)  # 65.7 deg about nadir, which is -y
    table = {"boresight": [0.0, -1.0, 0.0], "earth_exclusion": 0.2}
    assert seen(table, (limb + 0.2 + beyond, 0.0, 0.0)) == valid
    assert seen(table, (0.0, 0.0, limb + 0.2 + beyond)) == valid


@pytest.mark.parametrize(("rate", "valid"), [((0.03, 0.039, 0.0), 1.0), ((0.03, 0.041, 0.0), 0.0)])
def test_it_has_no_attitude_of_a_vehicle_that_turns_fast(rate: Any, valid: float) -> None:
    assert seen({"rate_limit": 0.05}, (0.0, 0.0, 0.0), SUN, rate) == valid


def test_its_noise_about_the_boresight_is_another() -> None:
    table = {"boresight": [0.0, 3.0, 4.0], "noise_std": "4 arcsec", "roll_noise_std": "30 arcsec"}
    tracker = StarTracker.model_validate(table)
    white = np.random.default_rng(1).normal(size=(20000, 3))
    noise = tracker.noise(0.1) * tracker.weighted(white)
    axis = np.array([0.0, 0.6, 0.8])
    along = noise @ axis
    across = noise - along[:, None] * axis
    arcsec = np.radians(1.0 / 3600.0)
    assert along.std() == pytest.approx(30.0 * arcsec, rel=0.03)
    assert across[:, 0].std() == pytest.approx(4.0 * arcsec, rel=0.03)
    assert np.sqrt(np.mean(across**2) * 1.5) == pytest.approx(4.0 * arcsec, rel=0.03)
    with pytest.raises(ValueError, match="roll_noise_std: needs a noise_std"):
        StarTracker.model_validate({"roll_noise_std": 1e-3})


def test_a_fine_sun_sensor_has_the_direction_in_body_axes() -> None:
    sensor = SunSensor.model_validate({"field_of_view": 0.5, "boresight": [1.0, 0.0, 0.0]})
    turned = motion((0.0, 0.0, 0.3))
    expected = [[np.cos(0.3), -np.sin(0.3), 0.0]]
    np.testing.assert_allclose(sensor.true_value(turned), expected, atol=1e-15)
    table = {"field_of_view": 0.5, "boresight": [1.0, 0.0, 0.0]}
    for angle, valid in ((0.49, 1.0), (0.51, 0.0)):
        assert seen(table, (0.0, 0.0, angle), kind=SunSensor) == valid
    assert seen({}, (0.0, 0.0, 0.0), BEHIND, kind=SunSensor) == 0.0
    small = np.array([[0.0, 0.0, 1e-3]])
    off = sensor.with_error(np.array([[1.0, 0.0, 0.0]]), small)
    np.testing.assert_allclose(off, [[np.cos(1e-3), np.sin(1e-3), 0.0]], atol=1e-15)


def test_half_of_the_disc_is_enough() -> None:
    # The Sun's centre is on the limb: half of the disc shows, but for the limb's curvature.
    limb = np.arcsin(EARTH / 7.0e6)
    radius = SUN_RADIUS / 1.5e11
    for off, valid in ((0.1 * radius, 1.0), (-0.1 * radius, 0.0)):
        angle = limb + off
        sun = PLACE + 1.5e11 * np.array([np.sin(angle), -np.cos(angle), 0.0])
        assert seen({}, (0.0, 0.0, 0.0), sun, kind=SunSensor) == valid
        assert seen({"boresight": [1, -1, 0], "sun_exclusion": 1.0}, (0, 0, 0), sun) == 0.0


def test_coarse_cells_have_the_cosines_that_are_above_zero() -> None:
    table = {"normals": [[1, 0, 0], [0, 2, 0], [1, 1, 0], [-1, 0, 0]]}
    cells = CoarseSunSensor.model_validate(table)
    current = cells.true_value(motion((0.0, 0.0, 0.3)))
    sine, cosine = np.sin(0.3), np.cos(0.3)
    expected = [[cosine, 0.0, (cosine - sine) / np.sqrt(2.0), 0.0]]
    np.testing.assert_allclose(current, expected, atol=1e-15)
    assert not cells.true_value(motion((0.0, 0.0, 0.3), BEHIND)).any()
    narrow = CoarseSunSensor.model_validate(table | {"field_of_view": 1.0})
    kept = narrow.true_value(motion((0.0, 0.0, 0.3)))
    np.testing.assert_allclose(kept, [[cosine, 0.0, 0.0, 0.0]], atol=1e-15)  # the third is 1.09 off


def test_satellite_navigation_is_from_the_earth_s_centre() -> None:
    moved = motion()._replace(
        position=np.array([[1.0, 2.0, 3.0]]), velocity=np.array([[0, 0, 5.0]])
    )
    assert GnssPosition().true_value(moved).tolist() == [[1.0, 7.0e6 + 2.0, 3.0]]
    assert GnssVelocity().true_value(moved).tolist() == [[7.5e3, 0.0, 5.0]]


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("{measures='sun_direction'}", r"sensors\.s: needs an environment\.epoch"),
        ("{measures='sun_cosines'}", r"sensors\.s: needs an environment\.epoch"),
        ("{measures='gnss_position'}", r"sensors\.s: needs an \[environment\.orbit\]"),
        ("{measures='attitude',sun_exclusion='30 deg'}", "sun_exclusion: needs an environment"),
        ("{measures='attitude',earth_exclusion='30 deg'}", "earth_exclusion: needs an"),
    ],
)
def test_what_is_not_there_cannot_be_looked_at(table: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        load("detumble-wheels", [f"sensors.s={table}"])
