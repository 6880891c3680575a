"""The Earth's field along an orbit is that of the reference, where the Earth has turned to."""

from datetime import UTC, datetime

import numpy as np
import pytest
from pydantic import ValidationError

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment import kepler
from mjspace.environment.earth_rotation import EARTH_ROTATION, sidereal_angle
from mjspace.environment.geomagnetism import along, field_at
from mjspace.environment.magnetic_field import MagneticField
from mjspace.environment.orbit import Orbit
from mjspace.scenario.environment import Environment

POLAR = Orbit(semi_major_axis=6.978e6, inclination=0.5 * np.pi)
CONTROL = 2.0
NEW_YEAR = datetime(2025, 1, 1)
IGRF = MagneticField(model="igrf")


def inertial(colatitude: float, longitude: float, turned: float) -> tuple[Array, Array]:
    """Return the axes (up, south, east) as rows, and up, of a place when Earth has ``turned``."""
    theta, phi = np.radians(colatitude), np.radians(longitude) + turned
    up = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    south = np.array([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), -np.sin(theta)])
    return np.array([up, south, np.cross(up, south)]), up


@pytest.mark.parametrize(
    ("radius", "colatitude", "longitude", "nanotesla"),
    [  # up, south, east, by another implementation of IGRF-14: ppigrf 2.1.0, igrf_gc
        (6978.0, 40.0, 12.0, [-34182.9287625, -15544.0196049, 849.1545775]),
        (6771.2, 115.0, -63.0, [9201.0695135, -16502.0564724, -2838.0301279]),
        (7500.0, 5.0, 170.0, [-36196.9156751, -1180.4219605, 150.1148912]),
    ],
)
def test_reference_field(
    radius: float, colatitude: float, longitude: float, nanotesla: list[float]
) -> None:
    time = 4000.0
    turned = sidereal_angle(NEW_YEAR) + EARTH_ROTATION * time
    axes, up = inertial(colatitude, longitude, turned)
    field = field_at(IGRF, NEW_YEAR, 1e3 * radius * up[None], np.array([time]))[0]
    # the same coefficients: rounding
    np.testing.assert_allclose(1e9 * axes @ field, nanotesla, atol=1e-6)


def test_sidereal_time_is_that_of_the_older_formula() -> None:
    # IAU 1982, at 0 h: good to the 0.1 s by which the models differ, 7e-6 rad
    for date in (datetime(1990, 6, 1), NEW_YEAR, datetime(2029, 12, 31)):
        T = ((date - datetime(2000, 1, 1)).days - 0.5) / 36525.0
        seconds = 24110.54841 + 8640184.812866 * T + 0.093104 * T**2 - 6.2e-6 * T**3
        angle = sidereal_angle(date)
        assert np.cos(angle - 2.0 * np.pi * seconds / 86400.0) > np.cos(1e-5)
        noon = sidereal_angle(date.replace(hour=12))
        half_a_day = EARTH_ROTATION * 43200.0
        assert np.cos(noon - angle - half_a_day) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("epoch", [datetime(1935, 3, 1), NEW_YEAR, datetime(2029, 12, 31)])
def test_dipole_is_the_reference_of_its_epoch_from_afar(epoch: datetime) -> None:
    rng = np.random.default_rng(1)
    up = attitude.normalize(rng.normal(size=(20, 3)))
    time = 1e5 * rng.uniform(size=20)
    tilted, real = MagneticField(), MagneticField(model="igrf")
    far = 6.4e9  # m: of the other degrees, 20 % at the surface, 1/1000 is left
    one, other = (field_at(table, epoch, far * up, time) for table in (tilted, real))
    assert np.abs(one - other).max() < 3e-4 * np.abs(one).max()
    upright = field_at(MagneticField(tilt=0.0), NEW_YEAR, 7e6 * np.eye(3)[:1], np.zeros(1))
    np.testing.assert_allclose(upright[0, :2], 0.0, atol=1e-20)
    assert upright[0, 2] > 2e-5


@pytest.mark.parametrize(("model", "bound"), [("dipole", 2e-13), ("igrf", 5e-13)])
def test_between_samples(model: str, bound: float) -> None:
    table = MagneticField(model=model)
    found = along(Environment(orbit=POLAR, magnetic_field=table), CONTROL, 3000.0)
    assert found.spacing == 10.0
    time = np.append(np.random.default_rng(2).uniform(0.0, 3000.0, 60), 3000.0)
    places = np.array([kepler.position(POLAR.elements(), t) for t in time])
    # of 4.5e-5 T: measured 7e-14 and 1.6e-13
    assert np.abs(found.at(time) - field_at(table, NEW_YEAR, places, time)).max() < bound
    # every period lies within one cubic, whatever rounding did to its beginning
    begins = CONTROL * np.arange(1500)
    assert np.all(found.rows(begins * (1.0 - 1e-15))[:, 0] == 10.0 * (begins // 10.0))


def test_what_is_refused() -> None:
    with pytest.raises(ValidationError, match="needs an orbit"):
        Environment(magnetic_field=IGRF)
    with pytest.raises(ValidationError, match="needs an orbit"):
        Environment(orbit=Orbit(body="moon", semi_major_axis=3e6), magnetic_field=IGRF)
    with pytest.raises(
        ValidationError, match=r"2031-01-01: the field .IGRF-14. is known from 1900 to 2030"
    ):
        MagneticField(epoch=datetime(2031, 1, 1))
    late = MagneticField(epoch="2026-07-01T02:00:00+02:00")
    assert late.epoch == datetime(2026, 7, 1, tzinfo=UTC).replace(tzinfo=None)
