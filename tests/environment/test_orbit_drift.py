"""The orbit's drift by J2: its rates, an integration of the field's forces, and continuity."""

from pathlib import Path

import numpy as np
import pytest
from compiled_flights import flown
from pydantic import ValidationError
from scipy.integrate import solve_ivp

from mjspace.contract import Array
from mjspace.environment import kepler
from mjspace.environment.constants import GM, J2, RADIUS
from mjspace.environment.orbit import Orbit, orbit_position, orbit_velocity
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble

DAY = 86400.0
BESIDE = """
description = "A satellite a metre ahead of the frame's origin, for a day"
duration = "86400 s"
[rates]
physics = "10 s"
control = "10 s"
[environment]
epoch = 2006-06-26T18:52:04
[environment.orbit]
semi_major_axis = "6878.137 km"
inclination = "97.4 deg"
j2 = true
[sensors.position]
[reference]
kind = "references:Hold"
[law]
kind = "coast:Coast"
"""
TLE = [
    "1 28057U 03049A   06177.78615833  .00000060  00000-0  35940-4 0  1836",
    "2 28057  98.4283 247.6961 0000884  88.1964 271.9322 14.35478080140550",
]
STATE = "position=['6878.137 km',0,0],velocity=[0,'-0.98 km/s','7.55 km/s']"


def test_a_sun_synchronous_orbit_keeps_up_with_the_sun() -> None:
    orbit = Orbit(semi_major_axis=6878.137e3, inclination=np.radians(97.4), j2=True)
    node, _, _ = orbit.drifts()
    # 360 deg in a tropical year of 365.2422 days; 97.40 deg is rounded: 0.005 deg are 7e-4 deg/day
    assert np.degrees(node) * DAY == pytest.approx(360.0 / 365.2422, abs=1.5e-3)


def test_molniya_keeps_its_perigee_and_a_polar_orbit_its_node() -> None:
    critical = np.arcsin(np.sqrt(0.8))
    frozen = Orbit(semi_major_axis=26.6e6, eccentricity=0.74, inclination=critical, j2=True)
    assert frozen.drifts()[1] == pytest.approx(0.0, abs=1e-22)
    polar = Orbit(semi_major_axis=7e6, inclination=0.5 * np.pi, j2=True)
    assert polar.drifts()[0] == pytest.approx(0.0, abs=1e-22)


def acceleration(time: float, state: Array) -> Array:
    """Return the derivative of position and velocity in the field of degree 2, order 0."""
    r = state[:3]
    radius = np.linalg.norm(r)
    central = -GM["earth"] / radius**3 * r
    scale = 1.5 * J2["earth"] * GM["earth"] * RADIUS["earth"] ** 2 / radius**5
    level = 5.0 * (r[2] / radius) ** 2
    return np.concatenate([state[3:], central + scale * r * (level - [1.0, 1.0, 3.0])])


def test_the_node_drifts_as_that_of_an_integrated_orbit() -> None:
    orbit = Orbit(semi_major_axis=7e6, inclination=1.0, j2=True)
    elements, turns = orbit.elements(), 15
    start = [*kepler.position(elements, 0.0), *kepler.velocity(elements, 0.0)]
    span = turns * 2.0 * np.pi / elements[1]
    flown = solve_ivp(acceleration, (0.0, span), start, "DOP853", rtol=1e-11, atol=1e-6)
    state = flown.y[:, -1]
    normal = np.cross(state[:3], state[3:])
    drifted = np.arctan2(normal[0], -normal[1])
    # whole turns, so that the short-periodic part is back; terms of second order, 1e-3, and the
    # start, whose elements are osculating and differ from mean ones by 2e-3
    assert drifted == pytest.approx(orbit.drifts()[0] * span, rel=5e-3)


def test_it_is_the_kepler_orbit_that_turns() -> None:
    table = {"semi_major_axis": 8e6, "eccentricity": 0.1, "inclination": 0.7, "periapsis": 0.4}
    still, drifting = Orbit(**table), Orbit(**table, j2=True)
    np.testing.assert_array_equal(orbit_position(drifting, 0.0), orbit_position(still, 0.0))
    node, periapsis, anomaly = drifting.drifts()
    time = 5e4
    later = Orbit(
        **table | {"periapsis": 0.4 + periapsis * time}, ascending_node=node * time
    ).elements()
    there = kepler.position(later, time * (1.0 + anomaly / later[1]))
    np.testing.assert_allclose(orbit_position(drifting, time), there, atol=1e-5)


@pytest.mark.parametrize(
    ("changes", "growth"),
    [
        (["environment.orbit.j2=false"], 0.01),
        ([], 0.01),  # 2459 m with GM alone
        (["environment.orbit.inclination='30 deg'"], 0.01),
        # 598 m; the pull is that of the mean rate, and the rate changes along the orbit
        (
            [
                "environment.orbit.eccentricity=0.05",
                "environment.orbit.semi_major_axis='7400 km'",
            ],
            0.25,
        ),
        ([f"environment.orbit={{tle={TLE}}}"], 0.1),  # 22 m
        ([f"environment.orbit={{{STATE},j2=true}}"], 0.1),  # 36 m with GM alone
    ],
)
def test_what_is_beside_the_origin_stays_there(
    changes: list[str], growth: float, tmp_path: Path
) -> None:
    (tmp_path / "beside.toml").write_text(BESIDE)
    orbit = load(tmp_path / "beside.toml", changes)[0].environment.orbit
    assert orbit is not None
    velocity = orbit_velocity(orbit, 0.0)
    ahead = velocity / np.linalg.norm(velocity)
    built = assemble(
        *load(tmp_path / "beside.toml", [*changes, f"initial.position={ahead.tolist()}"])
    )
    flight = flown(built)
    away = np.linalg.norm(flight.rows["/truth.position"][:, 0], axis=-1)
    # The orbit's elements alone are known beforehand: their rows are read by address.
    assert flight.compiled.startswith("compiled")
    # At rest relative to it in inertial axes, it goes three metres ahead and comes back each turn.
    assert away[:1000].max() == pytest.approx(3.0, rel=0.05)
    assert away.max() == pytest.approx(3.0, rel=growth)


def test_of_the_earth_alone() -> None:
    with pytest.raises(ValidationError, match="j2: is that of body"):
        Orbit(body="moon", semi_major_axis=3e6, j2=True)
