"""Orbits from two-line elements: SGP4's published vectors, its axes, flights, and bad lines."""

from datetime import datetime, timedelta
from importlib.resources import files
from pathlib import Path

import erfa
import numpy as np
import pytest
from compiled_flights import assembly, assert_same, flown
from pydantic import ValidationError

from mjspace.contract import Array
from mjspace.environment import kepler, two_line_elements
from mjspace.environment.earth_rotation import sidereal_angle
from mjspace.environment.orbit import Orbit, orbit_position
from mjspace.errors import InputError
from mjspace.runner.replay import verify
from mjspace.runner.run import run
from mjspace.scenario.environment import Environment

VANGUARD = [
    "1 00005U 58002B   00179.78495062  .00000023  00000-0  28098-4 0  4753",
    "2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667",
]
CBERS = [
    "1 28057U 03049A   06177.78615833  .00000060  00000-0  35940-4 0  1836",
    "2 28057  98.4283 247.6961 0000884  88.1964 271.9322 14.35478080140550",
]
GEOSTATIONARY = [  # Vallado's deep-space case with the Moon and the Sun
    "1 28626U 05008A   06176.46683397 -.00000205  00000-0  10000-3 0  2190",
    "2 28626   0.0019 286.9433 0000335  13.7918  55.6504  1.00270176  4891",
]


def published(number: int) -> Array:
    """Return rows of minutes, position [km] and velocity [km/s], of AIAA 2006-6753's tcppver.out.

    The authority's output comes with the package sgp4.
    """
    text = files("sgp4").joinpath("tcppver.out").read_text()
    after = f"\n{text}".partition(f"\n{number} xx\n")[2]
    block = after.partition(" xx\n")[0]  # to the number of the next satellite
    rows = [line.split()[:7] for line in block.splitlines() if len(line.split()) >= 7]
    return np.array(rows, dtype=float)


@pytest.mark.parametrize("tle", [VANGUARD, CBERS, GEOSTATIONARY], ids=["5", "28057", "28626"])
def test_it_is_where_the_authority_has_it(tle: list[str]) -> None:
    rows = published(int(tle[0][2:7]))
    assert len(rows) > 5
    orbit, time = Orbit(tle=tle), 60.0 * rows[:, 0]
    # the tables have 1e-8 km and 1e-9 km/s; a day is a double to 1e-11 s of it, and the epoch is
    # read to 1e-6 s, in which a satellite moves by 8 mm, its velocity by 1e-5 m/s
    np.testing.assert_allclose(orbit_position(orbit, time), 1e3 * rows[:, 1:4], atol=2e-2)
    elements = orbit.rows(time)
    speed = [kepler.velocity(row, t) for row, t in zip(elements, time, strict=True)]
    np.testing.assert_allclose(speed, 1e3 * rows[:, 4:7], atol=2e-5)


def test_time_zero_is_the_epoch_or_that_of_the_lines() -> None:
    own = datetime(2000, 6, 27, 18, 50, 19, 733568)
    environment = Environment(orbit=Orbit(tle=VANGUARD))
    assert environment.time_zero == own  # to a microsecond
    later = own + timedelta(hours=6)
    outside = Environment(epoch=later, orbit=Orbit(tle=VANGUARD))
    assert outside.time_zero == later
    there = orbit_position(outside.orbit, 0.0)
    np.testing.assert_allclose(there, orbit_position(environment.orbit, 21600.0), atol=1e-2)
    again = Environment(epoch=later, orbit=outside.orbit)
    assert again.orbit == outside.orbit
    with pytest.raises(ValidationError, match=r"orbit\n.*epoch: 2000-06-28.* differs from"):
        Environment(epoch=own, orbit=outside.orbit)


def test_the_axes_are_those_of_the_flight_to_ten_arc_seconds() -> None:
    # TEME has the true equator; mean axes differ by nutation, but for its part along the equator.
    angles = []
    for day in np.arange(0.0, 18.6 * 365.25, 10.0):
        date = 2451545.0 + 7000.0, day
        true_of_mean = erfa.num06a(*date)
        true_of_teme = erfa.rz(-erfa.ee06a(*date), np.eye(3))
        turn = true_of_mean.T @ true_of_teme
        angles.append(np.degrees(np.arccos((np.trace(turn) - 1.0) / 2.0)) * 3600.0)
    assert 9.0 < max(angles) < 10.0


def test_the_earth_turns_in_it_as_in_the_flight() -> None:
    from sgp4.propagation import gstime  # Greenwich sidereal time of 1982

    for year in (2000, 2026, 2045):
        epoch = datetime(year, 3, 1, 5)
        date = 2451545.0 + (epoch - datetime(2000, 1, 1, 12)) / timedelta(days=1)
        turned = np.degrees(sidereal_angle(epoch) - gstime(date) + np.pi) % 360.0 - 180.0
        assert abs(turned) * 3600.0 < 0.15  # measured 0.01, 0.06, 0.12


@pytest.mark.usefixtures("short_blocks")
def test_it_flies_compiled_and_from_its_log(tmp_path: Path) -> None:
    lines = f"environment.orbit={{tle={CBERS}}}".replace("'", '"')
    near = 'environment.epoch="2006-06-27T00:00:00"'  # not far from the elements' own
    built = assembly("leo-disturbances", "duration=40", lines, near)
    one = flown(built)
    assert one.compiled.startswith("compiled: ")
    assert_same(one, flown(built, compiled=False))
    whole = run(
        "leo-disturbances", overrides=["duration=20", "checks=[]", lines, near], out=tmp_path
    )
    assert verify(whole.log) is None


BAD = {
    "should be two lines, which begin with 1 and 2; got 1:": VANGUARD[:1],
    "line 1 is '2 00005": VANGUARD[::-1],
    "line 2 has 68 characters, should have 69": [VANGUARD[0], VANGUARD[1][:-1]],
    "line 1 ends with the checksum '4', should be 3": [VANGUARD[0][:-1] + "4", VANGUARD[1]],
    "of two satellites, '00005' and '28057'": [VANGUARD[0], CBERS[1]],
    r"00179x78495062 .* is not of the form '1 NNNNNC": [
        VANGUARD[0].replace("00179.", "00179x"),
        VANGUARD[1],
    ],
}


@pytest.mark.parametrize("message", BAD)
def test_bad_lines_are_refused_in_one(message: str) -> None:
    with pytest.raises(ValueError, match=message) as refused:
        two_line_elements.refuse_malformed(BAD[message])
    assert "\n" not in str(refused.value)


def test_what_goes_not_with_a_tle_is_refused() -> None:
    with pytest.raises(ValidationError, match="j2: SGP4 has it already"):
        Orbit(tle=CBERS, j2=True)
    with pytest.raises(ValidationError, match="got eccentricity and tle: an orbit has"):
        Orbit(tle=CBERS, eccentricity=0.1)
    with pytest.raises(ValidationError, match='tle: is of a satellite of body = "earth"'):
        Orbit(tle=CBERS, body="moon")


def test_a_satellite_that_decays_is_refused_before_the_flight() -> None:
    decaying = [  # of AIAA 2006-6753: in its last hours
        "1 29141U 85108AA  06170.26783845  .99999999  00000-0  13519-0 0   718",
        "2 29141  82.4288 273.4882 0015848 277.2124  83.9133 15.93343074  6828",
    ]
    orbit = f"environment.orbit={{tle={decaying}}}".replace("'", '"')
    lines = ["duration=28800", orbit, "environment.epoch=2006-06-19T06:25:41"]
    with pytest.raises(InputError, match=r"environment: at t = 25360 s, SGP4: .* has decayed"):
        assembly(
            "leo-disturbances", "duration=28800", *lines, "environment.facet_drag.density=1e-9"
        )
