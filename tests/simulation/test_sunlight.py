"""The Sun in flight: eclipses, what the log and a disturbance of one's own see, and one epoch."""

import math
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from compiled_flights import assembly, assert_same, flown
from pydantic import ValidationError

from mjspace import attitude
from mjspace.environment import sun
from mjspace.environment.constants import ASTRONOMICAL_UNIT, RADIUS, SUN_RADIUS
from mjspace.environment.earth_rotation import sidereal_angle
from mjspace.environment.magnetic_field import MagneticField
from mjspace.environment.orbit import Orbit, orbit_position
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.environment import Environment

EPOCH = datetime(2026, 3, 20, 12)
SHORT = ["duration=60", "environment.orbit.true_anomaly='112 deg'"]


@pytest.mark.usefixtures("short_blocks")
def test_everything_flies_compiled_as_in_python() -> None:
    built = assembly("leo-disturbances", *SHORT)
    one = flown(built)
    assert one.compiled == "compiled: sensors, law, actuators and step effects (the environment)"
    assert_same(one, flown(built, compiled=False))
    assert [event.message.partition(":")[0] for event in one.told] == [
        "in sunlight",
        "in the penumbra",
        "in the umbra",
    ]
    many = flown(built, (0, 1))
    assert many.bits(0) == many.bits(1) == one.bits(0)


def test_a_log_is_flown_again(tmp_path: Path) -> None:
    log = run("leo-disturbances", overrides=["duration=20", "checks=[]"], out=tmp_path / "x").log
    assert verify(log) is None


def test_eclipses_begin_and_end_where_the_cones_do() -> None:
    # A circle over the poles through the Sun, from 75 deg before the antisolar point on.
    s = sun.position(EPOCH, np.zeros(1))[0]
    radius, behind = 6.878e6, math.pi + math.asin(s[2] / np.linalg.norm(s))
    orbit = f"environment.orbit={{semi_major_axis={radius},inclination='90 deg',j2=false,"
    begin = behind - np.radians(75.0)
    orbit += f"ascending_node={math.atan2(s[1], s[0])},true_anomaly={begin}}}"
    rate = math.sqrt(3.986004418e14 / radius**3)
    found = flown(assembly("leo-disturbances", "duration=2500", orbit)).told
    times = [event.time for event in found]
    edges = []
    for sign in (1.0, -1.0):
        cone = math.asin((SUN_RADIUS + sign * RADIUS["earth"]) / ASTRONOMICAL_UNIT)
        edges.append(math.asin(RADIUS["earth"] / radius) + sign * cone)
    expected = [behind - edges[0], behind - edges[1], behind + edges[1], behind + edges[0]]
    expected = [(angle - begin) / rate for angle in expected]
    # a period of 1 s later at most; the Sun moves by 0.03 deg, 0.5 s of the orbit, and is 0.4 %
    # nearer or further than on average, 0.02 s
    assert len(times) == 5
    late = np.array(times[1:]) - expected
    assert np.all((late > -0.1) & (late < 1.6)), late


def test_the_direction_is_in_body_axes() -> None:
    built = assembly("leo-disturbances", *SHORT)
    rows = flown(built).rows
    time = rows["time"][:, 0]
    place = orbit_position(built.scenario.environment.orbit, time) + rows["/truth.position"][:, 0]
    sight = attitude.normalize(sun.position(EPOCH, time) - place)
    body = attitude.rotate(attitude.conjugate(rows["/truth.attitude"][:, 0]), sight)
    np.testing.assert_allclose(rows["/truth.sun_direction"][:, 0], body, atol=1e-8)


PUSH = """
import numpy as np

SEEN = []


def push(time, truth):
    SEEN.append((truth.sun_direction, truth.sunlight, truth.magnetic_field))
    return np.zeros(3), np.zeros(3)
"""


def test_a_disturbance_of_ones_own_sees_the_sun_and_the_field(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(PUSH)
    kind = f"environment.python='{tmp_path / 'own.py'}:push'"
    from mjspace.scenario.user_files import load_file

    rows = flown(assembly("leo-disturbances", *SHORT, kind, folder=tmp_path)).rows
    directions, parts, fields = map(
        np.array, zip(*load_file(tmp_path / "own.py").SEEN, strict=True)
    )
    n = len(directions)
    np.testing.assert_array_equal(directions, rows["/truth.sun_direction"][:n, 0])
    np.testing.assert_array_equal(parts, rows["/truth.sunlight"][:n, 0])
    assert np.ptp(parts) == 1.0
    assert np.all(np.linalg.norm(fields, axis=1) > 1e-5)


def test_without_an_epoch_nothing_is_said_of_the_sun() -> None:
    found = flown(assembly("lqr-gravity-gradient", "duration=10"))
    assert not any("sun" in name for name in found.rows)
    assert not found.told


def test_there_is_one_epoch() -> None:
    orbit = Orbit(semi_major_axis=7e6)
    old = Environment(orbit=orbit, magnetic_field=MagneticField(epoch=EPOCH))
    new = Environment(orbit=orbit, epoch=EPOCH, magnetic_field=MagneticField())
    both = Environment(orbit=orbit, epoch=EPOCH, magnetic_field=MagneticField(epoch=EPOCH))
    for one in (old, new, both):
        assert one.magnetic_field.time_zero(one) == EPOCH
    message = "magnetic_field.epoch: 2026-03-20 12:00:00 differs from environment.epoch, 2026-01-01"
    with pytest.raises(ValidationError, match=message):
        Environment(
            orbit=orbit, epoch=datetime(2026, 1, 1), magnetic_field=MagneticField(epoch=EPOCH)
        )
    with pytest.raises(ValidationError, match=r"2031-01-01: the field .IGRF-14. is known from"):
        Environment(orbit=orbit, epoch=datetime(2031, 1, 1), magnetic_field=MagneticField())


def test_the_sun_and_the_field_are_in_the_same_axes() -> None:
    # At noon of Greenwich the Sun stands over it, but for the equation of time: 7.4 min on 20 March
    turned = sidereal_angle(EPOCH)
    x, y, _ = sun.position(EPOCH, np.zeros(1))[0]
    hour_angle = np.degrees(turned - np.arctan2(y, x) + np.pi) % 360.0 - 180.0
    assert hour_angle * 4.0 == pytest.approx(-7.5, abs=0.2)
