"""The Moon's place: a published example, eclipses that were seen, and what its tide amounts to."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from mjspace.contract import Array
from mjspace.environment import moon, sun
from mjspace.environment.constants import ASTRONOMICAL_UNIT, GM

NOW = np.zeros(1)


def test_it_is_where_meeus_has_it() -> None:
    # Astronomical Algorithms, 2nd edition, example 47.a: 1992 April 12, 0 h dynamical time, in the
    # mean ecliptic and equinox of date. Its series and this one's differ in their last terms.
    x, y, z = moon.position(datetime(1992, 4, 12) - timedelta(seconds=69.184), NOW)[0]
    tilt = np.radians(23.440636)
    y, z = y * np.cos(tilt) + z * np.sin(tilt), z * np.cos(tilt) - y * np.sin(tilt)
    arc_second = 1.0 / 3600.0
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(133.162655, abs=2 * arc_second)
    assert np.degrees(np.arctan2(z, np.hypot(x, y))) == pytest.approx(-3.229126, abs=2 * arc_second)
    assert np.sqrt(x * x + y * y + z * z) == pytest.approx(368409.7e3, abs=5e3)


@pytest.mark.parametrize(
    ("greatest", "before"),
    [
        (datetime(2024, 4, 8, 18, 17, 21), True),
        (datetime(2017, 8, 21, 18, 25, 32), True),
        (datetime(2025, 3, 14, 6, 58, 47), False),
        (datetime(2022, 11, 8, 10, 59, 15), False),
    ],
)
def test_eclipses_are_when_they_were_seen(greatest: datetime, before: bool) -> None:
    # At the greatest eclipse (NASA's catalogues) Sun and Moon are nearest, or opposite.
    def apart(minutes: float) -> float:
        at = greatest + timedelta(minutes=minutes)
        one, other = (
            x / np.linalg.norm(x) for x in (sun.position(at, NOW), moon.position(at, NOW))
        )
        return float(np.degrees(np.linalg.norm(one - other if before else one + other)))

    assert apart(0.0) < 0.5
    nearest = min(np.linspace(-5.0, 5.0, 41), key=apart)
    assert abs(nearest) < 1.0  # geocentric; aberration of the Sun is 0.6 min of the Moon's motion


def test_the_spline_is_the_moon() -> None:
    epoch, duration = datetime(2026, 3, 20, 12), 30.0 * 86400.0
    time = np.linspace(0.0, duration, 1001)
    exact = moon.position(epoch, time)
    found = moon.along(epoch, 1.0, duration).at(time)
    off = np.linalg.norm(found - exact, axis=1) / np.linalg.norm(exact, axis=1)
    assert np.degrees(off.max()) < 4e-7


def gradient(gm: float, distance: Array | float) -> Array | float:
    """Return 3 GM/r^3, which times a difference of inertias is the largest torque's double."""
    return 3.0 * gm / distance**3


def test_the_tides_are_a_hundred_thousandth_of_the_earths_gradient() -> None:
    # What docs/environment.md says: of the Earth's, in a geostationary orbit and at 500 km.
    year = np.arange(0.0, 366.0) * 86400.0
    nearest = np.linalg.norm(moon.position(datetime(2026, 1, 1), year), axis=1).min()
    of_moon, of_sun = (
        gradient(GM["moon"], nearest),
        gradient(1.32712440e20, 0.983 * ASTRONOMICAL_UNIT),
    )
    high, low = (gradient(GM["earth"], r) for r in (42164e3, 6878e3))
    assert of_moon / high == pytest.approx(2.0e-5, rel=0.05)
    assert of_sun / high == pytest.approx(7.8e-6, rel=0.05)
    assert of_moon / low == pytest.approx(8.7e-8, rel=0.05)
