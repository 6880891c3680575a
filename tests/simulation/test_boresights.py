"""Boresights: their angles in the log, against the geometry, with units and events."""

from pathlib import Path

import numpy as np
import pytest

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.orbit import orbit_position
from mjspace.errors import InputError
from mjspace.plotting.panels import curves
from mjspace.runner.run import run
from mjspace.scenario.loading import load

CAMERA = "plant.boresights={camera={axis=[1,0,2]},tracker={axis=[0,-3,0]}}"
EPOCH = "environment.epoch=2026-03-20T12:00:00"


def angle(a: Array, b: Array) -> Array:
    return np.arccos(np.sum(attitude.normalize(a) * attitude.normalize(b), axis=-1))


def test_angles_are_those_of_the_geometry(tmp_path: Path) -> None:
    event = "events=[{name='planet in view',signal='truth.camera_limb_angle',below='-1 deg'}]"
    overrides = [CAMERA, EPOCH, event, "duration=5600", "checks=[]", "initial.position=[3e4,0,0]"]
    result = run("lqr-gravity-gradient", overrides=overrides, out=tmp_path)
    truth = result.log.read("/truth")
    orbit = load("lqr-gravity-gradient")[0].environment.orbit
    place = orbit_position(orbit, truth["time"]) + truth["position"]
    distance = np.linalg.norm(place, axis=-1)
    for name, axis in (("camera", [1.0, 0.0, 2.0]), ("tracker", [0.0, -1.0, 0.0])):
        looks = attitude.rotate(truth["attitude"], np.array(axis))
        off = angle(looks, -place)
        np.testing.assert_allclose(truth[f"{name}_nadir_angle"][:, 0], off, atol=1e-7)
        limb = off - np.arcsin(6378136.6 / distance)
        np.testing.assert_allclose(truth[f"{name}_limb_angle"][:, 0], limb, atol=1e-7)
        sun = angle(np.broadcast_to(axis, (len(off), 3)), truth["sun_direction"])
        np.testing.assert_allclose(truth[f"{name}_sun_angle"][:, 0], sun, atol=1e-7)
    seen = np.degrees(truth["camera_limb_angle"][:, 0]) < -1.0
    told = [e.time for e in result.log.events() if e.message.startswith("planet in view")]
    begins = truth["time"][np.flatnonzero(seen & ~np.roll(seen, 1))]
    np.testing.assert_allclose(told, begins, atol=1e-9)
    assert len(told) == 1
    assert result.log.units["/truth"]["camera_sun_angle"] == "rad"
    titles = [curve.panel.title for curve in curves(result.log)]
    assert "Angle of tracker from the planet's limb" in titles


def test_without_an_epoch_nothing_is_said_of_the_sun(tmp_path: Path) -> None:
    result = run(
        "lqr-gravity-gradient", overrides=[CAMERA, "duration=2", "checks=[]"], out=tmp_path
    )
    fields = result.log.topics["/truth"]
    assert "camera_nadir_angle" in fields
    assert "camera_sun_angle" not in fields


def test_without_an_orbit_they_are_refused() -> None:
    with pytest.raises(InputError, match=r"plant.boresights: needs an \[environment.orbit\]"):
        load("detumble-wheels", [CAMERA])
