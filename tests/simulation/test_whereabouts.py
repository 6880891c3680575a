"""Where a vehicle is above the Earth, where it sees the Moon, and both in its log."""

import math
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from compiled_flights import assembly, flown
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from mjspace import attitude
from mjspace.environment import moon
from mjspace.environment.earth_rotation import EARTH_ROTATION, geodetic, sidereal_angle
from mjspace.environment.orbit import Orbit, orbit_position
from mjspace.runner.run import run
from mjspace.scenario.log_rates import LogRates

EPOCH = datetime(2026, 3, 20, 12)


def test_geodetic_coordinates_are_those_of_the_ellipsoid() -> None:
    # WGS 84: a = 6378137 m, 1/f = 298.257223563; NIMA TR8350.2, equations 4-14 and 4-15.
    a, f = 6378137.0, 1.0 / 298.257223563
    squared = f * (2.0 - f)
    rng = np.random.default_rng(1)
    latitude, longitude = np.arcsin(rng.uniform(-1, 1, 50)), rng.uniform(-np.pi, np.pi, 50)
    height, time = rng.uniform(2e5, 4e7, 50), rng.uniform(0.0, 1e5, 50)
    across = a / np.sqrt(1.0 - squared * np.sin(latitude) ** 2)
    turned = longitude + sidereal_angle(EPOCH) + EARTH_ROTATION * time
    level = (across + height) * np.cos(latitude)
    z = (across * (1.0 - squared) + height) * np.sin(latitude)
    place = np.column_stack([level * np.cos(turned), level * np.sin(turned), z])
    found = geodetic(EPOCH, place, time)
    np.testing.assert_allclose(found[0], longitude, atol=1e-11)
    np.testing.assert_allclose(found[1], latitude, atol=1e-11)
    np.testing.assert_allclose(found[2], height, atol=1e-5)


def test_a_geostationary_satellite_stands_where_it_is_stationed() -> None:
    tle = [  # of AIAA 2006-6753: XM-3, at 85 deg west
        "1 28626U 05008A   06176.46683397 -.00000205  00000-0  10000-3 0  2190",
        "2 28626   0.0019 286.9433 0000335  13.7918  55.6504  1.00270176  4891",
    ]
    orbit, time = Orbit(tle=tle), np.linspace(0.0, 86400.0, 25)
    assert orbit.time_zero is not None
    longitude, latitude, height = geodetic(orbit.time_zero, orbit_position(orbit, time), time)
    assert np.all(np.abs(np.degrees(longitude) + 85.0) < 0.15)  # its slot, and where it was in it
    assert np.all(np.abs(np.degrees(latitude)) < 0.02)
    assert np.all(np.abs(height - 35786e3) < 5e3)


def test_it_is_in_the_truth_of_a_flight() -> None:
    built = assembly("leo-disturbances", "duration=60")
    rows = flown(built).rows
    time = rows["time"][:, 0]
    place = orbit_position(built.scenario.environment.orbit, time) + rows["/truth.position"][:, 0]
    sight = attitude.normalize(moon.position(EPOCH, time) - place)
    body = attitude.rotate(attitude.conjugate(rows["/truth.attitude"][:, 0]), sight)
    np.testing.assert_allclose(rows["/truth.moon_direction"][:, 0], body, atol=1e-8)
    for name, values in zip(
        ("longitude", "latitude", "height"), geodetic(EPOCH, place, time), strict=True
    ):
        np.testing.assert_array_equal(rows[f"/truth.{name}"][:, 0, 0], values)


SEEN = """
import numpy as np

SEEN = []


def push(time, truth):
    SEEN.append((*truth.moon_direction, *truth.latitude, *truth.longitude, *truth.height))
    return np.zeros(3), np.zeros(3)
"""


def test_a_disturbance_of_ones_own_is_told(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(SEEN)
    kind = f"environment.python='{tmp_path / 'own.py'}:push'"
    from mjspace.scenario.user_files import load_file

    rows = flown(assembly("leo-disturbances", "duration=5", kind, folder=tmp_path)).rows
    seen = np.array(load_file(tmp_path / "own.py").SEEN)
    names = ("moon_direction", "latitude", "longitude", "height")
    logged = np.hstack([rows[f"/truth.{name}"][:, 0] for name in names])
    np.testing.assert_array_equal(seen, logged[: len(seen)])


@pytest.mark.parametrize(("rates", "every"), [([], 2), (["log.location='3 s'"], 6)])
def test_viewers_have_the_place_as_a_fix(tmp_path: Path, rates: list[str], every: int) -> None:
    short = ["duration=20", "rates.physics=0.5", "rates.control=0.5", "checks=[]", *rates]
    log = run("leo-disturbances", overrides=short, out=tmp_path / "x").log
    truth = log.read("/truth")
    with log.path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        fixes = [d for *_, d in reader.iter_decoded_messages(["/location"])]
    logged = sorted({*range(0, 41, every), 40})
    assert [round(f.timestamp.ToNanoseconds() / 5e8) for f in fixes] == logged
    for fix, row in zip(fixes, logged, strict=True):
        assert fix.frame_id == "bus"
        assert fix.latitude == math.degrees(truth["latitude"][row].item())
        assert fix.longitude == math.degrees(truth["longitude"][row].item())
        assert fix.altitude == truth["height"][row].item()


def test_a_fix_a_second_at_most() -> None:
    assert LogRates().every(0.1)["/location"] == 10
    assert LogRates(default=5.0).every(0.1)["/location"] == 50
    assert LogRates(location=0.2).every(0.1)["/location"] == 2


def test_without_an_epoch_there_is_none(tmp_path: Path) -> None:
    short = ["duration=1", "checks=[]"]
    log = run("lqr-gravity-gradient", overrides=short, out=tmp_path / "x").log
    assert not {"latitude", "moon_direction"} & set(log.read("/truth"))
    with log.path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert "/location" not in {channel.topic for channel in summary.channels.values()}
