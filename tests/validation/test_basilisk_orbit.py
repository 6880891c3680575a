"""What Basilisk is told of a scenario's satellite."""

import math
from pathlib import Path

import numpy as np
import pytest

from mjspace.environment.geomagnetism import field_at
from mjspace.environment.orbit import orbit_position
from mjspace.scenario.loading import load
from mjspace.scenario.scenario import Scenario
from mjspace.validation.basilisk_orbit import CASES, SCENARIO, describe


def case(name: str, folder: Path) -> Scenario:
    path = folder / "orbit.toml"
    path.write_text(SCENARIO)
    (settings,) = (case.settings for case in CASES if case.name == f"basilisk-{name}")
    return load(path, settings)[0]


def test_the_dipole_by_its_coefficients_is_our_field(tmp_path: Path) -> None:
    """By the formula of degree one, g10 about the Earth's axis and g11 towards Greenwich."""
    scenario = case("dipole", tmp_path)
    told, environment = describe(scenario), scenario.environment
    time = np.array([0.0, 500.0])
    place = orbit_position(environment.orbit, time)
    fields = []
    for t, r in zip(time, place, strict=True):
        angle = told["earth_angle"] + told["earth_rate"] * t
        x, y, z = told["dipole"]["coefficients"]
        c, s = math.cos(angle), math.sin(angle)
        axis = np.array([c * x - s * y, s * x + c * y, z])
        up = r / np.linalg.norm(r)
        fields.append((3.0 * up * (up @ axis) - axis) / np.linalg.norm(r) ** 3)
    ours = field_at(environment.magnetic_field, environment.time_zero, place, time)
    np.testing.assert_allclose(fields, ours, rtol=1e-12)  # rounding


def test_the_air_is_as_dense_from_the_ground_as_from_its_own_altitude(tmp_path: Path) -> None:
    told = describe(case("drag", tmp_path))["drag"]
    at_400_km = told["density"] * math.exp(-400e3 / told["scale_height"])
    assert at_400_km == pytest.approx(3.7e-12, rel=1e-12)
    assert [facet["area"] for facet in told["facets"]] == [3.0, 3.0, 1.0]
    assert all(np.linalg.norm(facet["normal"]) == pytest.approx(1.0) for facet in told["facets"])
