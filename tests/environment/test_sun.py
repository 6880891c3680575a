"""The Sun's place: between samples, against the almanac's formula, and at an equinox."""

from datetime import datetime

import numpy as np
import pytest

from mjspace.contract import Array
from mjspace.environment import sun

DAY = 86400.0


def angle(one: Array, other: Array) -> Array:
    """Return the angles between the rows [deg]; of small ones to rounding."""
    cross = np.linalg.norm(np.cross(one, other), axis=-1)
    return np.degrees(np.arctan2(cross, np.sum(one * other, axis=-1)))


@pytest.mark.parametrize("duration", [DAY, 366.0 * DAY])
def test_between_samples(duration: float) -> None:
    epoch = datetime(2026, 3, 20)
    found = sun.along(epoch, 0.7, duration)
    time = np.append(np.random.default_rng(3).uniform(0.0, duration, 500), duration)
    real = sun.position(epoch, time)
    # measured 8e-8 deg and 4e-9 of the distance
    assert angle(found.at(time), real).max() < 1e-6
    ratio = np.linalg.norm(found.at(time), axis=1) / np.linalg.norm(real, axis=1)
    assert np.abs(ratio - 1.0).max() < 1e-7


@pytest.mark.parametrize("year", [1955, 1999, 2026, 2048])
def test_the_almanacs_formula(year: int) -> None:
    # The Astronomical Almanac, low-precision formulas of the Sun's coordinates: 0.01 deg and
    # 3e-4 au, from 1950 to 2050; with aberration, 0.0057 deg, and axes of date.
    epoch = datetime(year, 1, 1)
    for month in range(1, 13):
        date = datetime(year, month, 11, 7)
        n = (date - datetime(2000, 1, 1, 12)).total_seconds() / DAY
        g = np.radians(357.528 + 0.9856003 * n)
        longitude = np.radians(280.460 + 0.9856474 * n + 1.915 * np.sin(g) + 0.020 * np.sin(2 * g))
        tilt = np.radians(23.439 - 4e-7 * n)
        distance = 1.00014 - 0.01671 * np.cos(g) - 0.00014 * np.cos(2.0 * g)
        place = [np.cos(longitude), np.cos(tilt) * np.sin(longitude)]
        formula = np.array([*place, np.sin(tilt) * np.sin(longitude)])
        ours = sun.position(date, np.zeros(1))[0]
        assert angle(ours, formula) < 0.01 + 0.006
        assert np.linalg.norm(ours) / 149597870700.0 == pytest.approx(distance, abs=3e-4)
        # in the axes of the year's first day precession leaves 0.014 deg a year
        later = sun.position(epoch, np.array([(date - epoch).total_seconds()]))[0]
        assert angle(later, ours) < 0.0141 * (month + 1) / 12.0


def test_an_equinox() -> None:
    # 2026-03-20 14:46 UTC: then the apparent longitude is 0, and the geometric 20.5" more
    x, y, z = sun.position(datetime(2026, 3, 20, 14, 46), np.zeros(1))[0]
    tilt = np.radians(23.436)
    longitude = np.arctan2(y * np.cos(tilt) + z * np.sin(tilt), x)
    # a minute is 7e-4 deg, nutation in longitude up to 0.005 deg
    assert np.degrees(longitude) == pytest.approx(20.5 / 3600.0, abs=0.0055)
    assert z * np.cos(tilt) - y * np.sin(tilt) == pytest.approx(0.0, abs=5e-6 * x)
