"""NRLMSIS along an orbit: between samples, beside it, the Sun's activity, and drag in flight."""

from datetime import datetime
from typing import Any

import numpy as np
import pytest
from compiled_flights import assembly, assert_same, flown
from pydantic import ValidationError

from mjspace.environment import nrlmsis
from mjspace.environment.facet_drag import Nrlmsis
from mjspace.environment.orbit import Orbit, orbit_position
from mjspace.scenario.environment import Environment

EPOCH = datetime(2026, 3, 20, 12)
SIDE = {"area": 1.0, "normal": [1.0, 0.0, 0.0], "position": [0.0, 0.0, 0.0]}
ORBIT = {"semi_major_axis": 6.878e6, "inclination": 1.7, "eccentricity": 0.01}


def outside(**changes: Any) -> Environment:
    drag = {"nrlmsis": {"f107": 150.0}}
    table = {"epoch": EPOCH, "orbit": ORBIT, "facets": [SIDE], "facet_drag": drag}
    return Environment.model_validate(table | changes)


def test_between_samples_and_beside_the_orbit() -> None:
    where = outside()
    found = nrlmsis.along(where, 1.0, 6000.0)
    time = np.random.default_rng(0).uniform(0.0, 6000.0, 300)
    places = orbit_position(where.orbit, time)
    logarithm, radius, falling = found.at(time).T
    real, _ = nrlmsis.density_at(EPOCH, where.facet_drag.nrlmsis, places, time)
    # pymsis computes in single precision; 4e-5 measured
    np.testing.assert_allclose(np.exp(logarithm), real, rtol=1e-4)
    np.testing.assert_allclose(radius, np.linalg.norm(places, axis=1), atol=0.1)
    higher = places * (1.0 + 1e4 / radius)[:, None]
    above, _ = nrlmsis.density_at(EPOCH, where.facet_drag.nrlmsis, higher, time)
    np.testing.assert_allclose(np.exp(logarithm - 1e4 * falling), above, rtol=0.03)


def test_an_active_sun_makes_the_air_denser() -> None:
    place, time = orbit_position(Orbit(**ORBIT), np.arange(100) * 60.0), np.arange(100) * 60.0
    quiet, active = (
        nrlmsis.density_at(EPOCH, Nrlmsis(f107=flux), place, time)[0].mean() for flux in (70, 230)
    )
    stormy = nrlmsis.density_at(EPOCH, Nrlmsis(f107=70, ap=100.0), place, time)[0].mean()
    assert 5.0 < active / quiet < 30.0  # Vallado 2013, figure 8-3: a factor of about ten at 500 km
    assert stormy > 1.3 * quiet


@pytest.mark.parametrize("hour", [0, 6, 12, 18])
def test_noon_is_denser_than_night_where_the_sun_is(hour: int) -> None:
    # the bulge is two hours behind the Sun, at about 30 deg east of it
    angles = np.radians(np.arange(0.0, 360.0, 15.0))
    place = 6.878e6 * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    density, _ = nrlmsis.density_at(
        EPOCH.replace(hour=hour), Nrlmsis(f107=150), place, np.zeros(len(angles))
    )
    # inertial x is at the equinox, where the Sun is on 20 March
    assert 15.0 <= np.degrees(angles[np.argmax(density)]) <= 60.0
    assert density.max() > 3.0 * density.min()


def test_in_flight_it_is_the_drag_of_that_density() -> None:
    alone = [
        *("duration=60", "environment.solar_pressure.pressure=1e-30"),
        "environment.facets=[{area=9,normal=[-1,0,0],position=[0,0,0]}]",
    ]
    built = assembly("leo-disturbances", *alone, "environment.facet_drag.nrlmsis={f107=150}")
    one = flown(built)
    assert_same(one, flown(built, compiled=False))
    other = flown(assembly("leo-disturbances", *alone, "environment.facet_drag.density=1e-12"))
    # /disturbance is of the step's end
    time = one.rows["time"][1:, 0]
    places = orbit_position(built.scenario.environment.orbit, time)
    table = built.scenario.environment.facet_drag.nrlmsis
    density, _ = nrlmsis.density_at(EPOCH, table, places, time)
    of_one, of_other = (
        np.linalg.norm(flight.rows["/disturbance.force"][1:, 0], axis=1) for flight in (one, other)
    )
    # single precision, and what is left of the gravity gradient at 1e-4 m
    np.testing.assert_allclose(of_one / of_other, density / 1e-12, rtol=1e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"epoch": None}, "facet_drag.nrlmsis: needs environment.epoch and an orbit"),
        (
            {"facet_drag": {"nrlmsis": {"f107": 150.0}, "density": 1e-12}},
            "density and nrlmsis: give one of them",
        ),
        ({"facets": []}, r"facet_drag: needs \[\[environment.facets\]\]"),
        ({"facet_drag": {"nrlmsis": {"f107": 150.0}, "facets": [SIDE]}}, "of its own, not both"),
    ],
)
def test_what_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        outside(**changes)
