"""The Sun's direction and the field, as sensors and as the on-board models have them."""

from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from mjspace import attitude as att
from mjspace.environment import sun
from mjspace.environment.constants import ASTRONOMICAL_UNIT
from mjspace.errors import InputError
from mjspace.scenario.loading import load
from mjspace.sensors.base import Motion, Surroundings
from mjspace.sensors.field_reference import FieldReference
from mjspace.sensors.magnetometer import Magnetometer
from mjspace.sensors.sun_reference import SunReference
from mjspace.sensors.sun_sensor import SunSensor
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly, what_is_compiled

RADIUS = 7e6
SUN = np.array([0.6, 0.0, 0.8]) * ASTRONOMICAL_UNIT
FIELD = np.array([1e-5, -2e-5, 3e-5])
ORBIT = """
description = "what is seen of Sun and field"
duration = "3000 s"
[rates]
physics = "2 s"
control = "4 s"
[initial]
rate = [1e-3, -2e-3, 1e-3]
[environment]
epoch = 2026-03-20T12:00:00
[environment.orbit]
semi_major_axis = "7000 km"
[environment.magnetic_field]
[sensors.sun_direction]
[sensors.sun_reference]
[sensors.magnetic_field]
[sensors.field_reference]
[reference]
kind = "references:Hold"
[law]
kind = "coast:Coast"
"""


def moving(place: np.ndarray) -> Motion:
    """Return the motion of buses at ``place``, (n, 3), each in another attitude."""
    draw = np.random.default_rng(5)
    count = len(place)
    none = np.zeros((count, 3))
    around = Surroundings(
        magnetic_field=lambda time: np.broadcast_to(FIELD, (len(time), 3)),
        sun_position=lambda time: np.broadcast_to(SUN, (len(time), 3)),
        orbit_position=lambda time: place,
    )
    q = att.normalize(draw.normal(size=(count, 4)))
    return Motion(np.zeros(count), q, none, none, none, none, around)


def test_the_suns_direction_is_the_almanacs_in_body_axes() -> None:
    s = SUN / ASTRONOMICAL_UNIT
    across = np.cross(s, [0.0, 1.0, 0.0])
    beside = [-RADIUS * s + x * across for x in (0.0, 6.3e6, 6.4e6)]
    motion = moving(np.array([*beside, RADIUS * s, 6.9e6 * across]))
    seen, known = SunSensor().true_value(motion), SunReference().true_value(motion)
    assert np.allclose(np.linalg.norm(known, axis=-1), 1.0, rtol=1e-15)
    assert np.allclose(att.rotate(motion.attitude, seen), known, atol=1e-15)
    # The bus is 7000 km from where the Sun's direction is s: 5e-5 rad at most.
    assert np.abs(known - s).max() < RADIUS / ASTRONOMICAL_UNIT
    assert np.abs(known[2] - s).max() > 0.5 * 6.4e6 / ASTRONOMICAL_UNIT


def test_the_field_is_the_magnetometers_in_inertial_axes() -> None:
    motion = moving(np.full((3, 3), 4e6))
    turned = att.rotate(motion.attitude, Magnetometer().true_value(motion))
    assert np.allclose(turned, FieldReference().true_value(motion), rtol=1e-14)


def test_errors_of_directions_are_rotations() -> None:
    value = np.array([[0.0, 0.0, 1.0]])
    for sensor in (SunSensor(noise_std=0.01), SunReference(noise_std=0.01)):
        off = sensor.with_error(value, np.array([[0.01, 0.0, 0.0]]))
        assert np.allclose(off, [[0.0, -np.sin(0.01), np.cos(0.01)]], atol=1e-16)
    rounded = SunSensor(quantization=0.01).with_error(value + 0.004, np.zeros((1, 3)))
    assert np.allclose(rounded, [[0.0, 0.0, 1.0]], atol=1e-15)


def test_they_fly_compiled_and_agree_with_the_almanac(tmp_path: Path) -> None:
    (tmp_path / "orbit.toml").write_text(ORBIT)
    built = assemble(*load(tmp_path / "orbit.toml"))
    assert what_is_compiled(built).startswith("compiled: ")
    blocks = list(fly(built, first_start(built, [0])))
    measured, truth = (
        {
            name: np.concatenate([block.rows[topic][name][:, 0] for block in blocks])
            for name in blocks[0].rows[topic]
        }
        for topic in ("/measurement", "/truth")
    )
    time = np.concatenate([block.time for block in blocks])
    almanac = att.normalize(sun.position(datetime(2026, 3, 20, 12), time))
    known = measured["sun_reference"]
    assert np.abs(known - almanac).max() < 7e6 / (0.98 * ASTRONOMICAL_UNIT)
    dark = measured["sun_direction_valid"][:, 0] < 0.5
    assert 0.3 < dark.mean() < 0.6
    assert np.array_equal(dark, truth["sunlight"][:, 0] < 0.5)
    seen = att.rotate(measured["attitude"], measured["sun_direction"])
    assert np.allclose(seen[~dark], known[~dark], atol=1e-12)
    field = att.rotate(measured["attitude"], measured["magnetic_field"])
    assert np.allclose(field, measured["field_reference"], rtol=1e-12)


@pytest.mark.parametrize("quantity", ["sun_direction", "sun_reference", "field_reference"])
def test_without_epoch_orbit_or_field_they_are_refused(quantity: str) -> None:
    needs = {
        "field_reference": r"needs an \[environment.magnetic_field\]",
    }.get(quantity, r"needs an environment.epoch and an \[environment.orbit\]")
    with pytest.raises(InputError, match=rf"sensors.{quantity}: {needs}"):
        load("detumble-wheels", [f"sensors.{quantity}.measures={quantity}"])
