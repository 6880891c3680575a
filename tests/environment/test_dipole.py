"""The field of a dipole is what its closed forms say."""

from datetime import datetime

import numpy as np
import pytest

from mjspace.contract import Array
from mjspace.environment.dipole import dipole, northern_pole
from mjspace.environment.geomagnetism import dipole_of

STRENGTH, RADIUS = 7.7e15, 7.0e6  # T m^3, m
EQUATOR = STRENGTH / RADIUS**3  # T
NORTH = (0.0, 0.0, 1.0)


def place(latitude: float, longitude: float = 0.3) -> Array:
    east = np.array([np.cos(longitude), np.sin(longitude), 0.0])
    return RADIUS * (np.cos(latitude) * east + np.sin(latitude) * np.array(NORTH))


def test_field_on_the_equator_and_at_the_poles() -> None:
    # rounding of some ten operations
    np.testing.assert_allclose(
        dipole(place(0.0), NORTH, STRENGTH), [0.0, 0.0, EQUATOR], atol=1e-15 * EQUATOR
    )
    for latitude in (0.5 * np.pi, -0.5 * np.pi):
        # twice as strong; down in the north, up in the south
        np.testing.assert_allclose(
            dipole(place(latitude), NORTH, STRENGTH), [0.0, 0.0, -2.0 * EQUATOR], atol=1e-20
        )


@pytest.mark.parametrize("latitude", np.linspace(-1.5, 1.5, 13))
def test_inclination_and_strength_along_a_meridian(latitude: float) -> None:
    here = place(latitude)
    field = np.array(dipole(here, NORTH, STRENGTH))
    up = here / RADIUS
    down = -field @ up
    level = np.linalg.norm(field + down * up)
    assert down / level == pytest.approx(2.0 * np.tan(latitude), rel=1e-12, abs=1e-14)
    strength = EQUATOR * np.sqrt(1.0 + 3.0 * np.sin(latitude) ** 2)
    assert np.linalg.norm(field) == pytest.approx(strength, rel=1e-14)


def test_field_has_neither_sources_nor_currents() -> None:
    here, step = place(0.7), 100.0  # m
    slope = np.array(
        [
            np.subtract(dipole(here + d, NORTH, STRENGTH), dipole(here - d, NORTH, STRENGTH))
            for d in step * np.eye(3)
        ]
    ) / (2.0 * step)
    # central differences: (step / radius)^2 = 2e-10 of the slope, rounding 1e-12 of it
    assert abs(np.trace(slope)) < 1e-9 * np.abs(slope).max()
    np.testing.assert_allclose(slope, slope.T, atol=1e-9 * np.abs(slope).max())


def test_a_tilted_dipole_turns_with_its_planet() -> None:
    tilt, longitude, rotation = 0.2, -1.3, 7e-5
    day = 2.0 * np.pi / rotation
    for part in (0.0, 0.25, 0.6):
        north = np.array(northern_pole(part * day, tilt, longitude, rotation))
        angle = longitude + 2.0 * np.pi * part
        turn = np.array([np.cos(angle), np.sin(angle)])
        np.testing.assert_allclose(north, [*np.sin(tilt) * turn, np.cos(tilt)], atol=1e-15)
        # over the magnetic pole the field points down, and is the strongest
        field = np.array(dipole(RADIUS * north, north, STRENGTH))
        np.testing.assert_allclose(field, -2.0 * EQUATOR * north, atol=1e-15 * EQUATOR)


def test_the_earth_is_the_earth() -> None:
    earth = dipole_of(datetime(2020, 1, 1))
    north = np.array(northern_pole(0.0, earth.tilt, earth.longitude, 0.0))
    # The geomagnetic pole of 2020 in table 4 of the reference, 80.65 N (geodetic) and 72.68 W
    geodetic = np.arctan(north[2] / np.hypot(north[0], north[1]) / (1.0 - 0.00669438))
    assert np.degrees(geodetic) == pytest.approx(80.65, abs=0.005)
    assert np.degrees(np.arctan2(north[1], north[0])) == pytest.approx(-72.68, abs=0.005)
    # Alken et al. 2021, table 2, of the generation before: within 2 nT
    surface = earth.strength / 6371.2e3**3
    assert surface == pytest.approx(1e-9 * np.sqrt(29404.8**2 + 1450.9**2 + 4652.5**2), rel=1e-4)


@pytest.mark.parametrize(
    ("epoch", "nanotesla"),
    [  # g10, g11, h11 of IGRF-14; the second is the mean of 2015 and 2020
        (datetime(1900, 1, 1), (-31543.0, -2298.0, 5922.0)),
        (datetime(2017, 7, 2), (-29422.435, -1476.57, 4724.67)),
        (datetime(2025, 1, 1), (-29350.0, -1410.3, 4545.5)),
    ],
)
def test_the_dipole_is_that_of_its_epoch(
    epoch: datetime, nanotesla: tuple[float, float, float]
) -> None:
    earth = dipole_of(epoch)
    south = -np.array(northern_pole(0.0, earth.tilt, earth.longitude, 0.0))
    # of 29,900 nT: the table has a tenth of one, and a date is within half a day of the year's half
    terms = 1e9 * earth.strength / 6371.2e3**3 * south
    np.testing.assert_allclose(terms[[2, 0, 1]], nanotesla, atol=0.2)
