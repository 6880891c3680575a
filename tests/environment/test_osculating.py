"""An orbit from a position and velocity: the same as from elements, circles and equators too."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from mjspace.contract import Array
from mjspace.environment import kepler
from mjspace.environment.constants import GM
from mjspace.environment.orbit import Orbit, orbit_position
from mjspace.environment.osculating import elements_of

TIMES = np.linspace(0.0, 3e4, 7)


def state(orbit: Orbit, time: float = 0.0) -> tuple[Array, Array]:
    elements = orbit.rows(np.array([time]))[0]
    return np.array(kepler.position(elements, time)), np.array(kepler.velocity(elements, time))


def of_state(place: Array, velocity: Array) -> Orbit:
    return Orbit(position=place.tolist(), velocity=velocity.tolist())


@settings(max_examples=300, deadline=None)  # the first one compiles
@given(
    st.sampled_from([0.0, 1e-15, 1e-13, 1e-11, 1e-8, 1e-3, 0.1, 0.7]),
    st.sampled_from([0.0, 1e-12, 1e-6, 0.9, np.pi / 2, np.pi - 1e-12, np.pi]),
    *[st.floats(-6.0, 6.0)] * 3,
)
def test_it_is_the_orbit_of_the_elements(
    eccentricity: float, inclination: float, node: float, periapsis: float, anomaly: float
) -> None:
    orbit = Orbit(
        semi_major_axis=3e7,
        eccentricity=eccentricity,
        inclination=inclination,
        ascending_node=node,
        periapsis=periapsis,
        true_anomaly=anomaly,
    )
    again = of_state(*state(orbit))
    # rounding of the start, 1e-15 of 3e7 m, grows with 3 n t / (1 - e), at most 40 here
    np.testing.assert_allclose(
        orbit_position(again, TIMES), orbit_position(orbit, TIMES), atol=2e-5
    )
    # an eccentricity below 1e-12 counts as none: 1e-12 of 3.6e3 m/s
    np.testing.assert_allclose(state(again)[1], state(orbit)[1], atol=4e-9)


def test_a_motion_is_its_own_at_any_time() -> None:
    orbit = Orbit(semi_major_axis=8e6, eccentricity=0.05, inclination=0.4, periapsis=1.0)
    place, velocity = (np.stack(x) for x in zip(*(state(orbit, t) for t in TIMES), strict=True))
    rows = elements_of(place, velocity, TIMES, GM["earth"])
    now = np.array([kepler.velocity(row, t) for row, t in zip(rows, TIMES, strict=True)])
    np.testing.assert_allclose(now, velocity, atol=1e-9)
    np.testing.assert_allclose(kepler.along.ufunc(rows, TIMES, np.zeros(3))[0], place, atol=1e-6)
    later = kepler.along.ufunc(rows, TIMES + 5e3, np.zeros(3))[0]
    np.testing.assert_allclose(later, orbit_position(orbit, TIMES + 5e3), atol=1e-4)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"eccentricity": 1.0, "semi_major_axis": 7e6}, "eccentricity\n.*got 1, should be less th"),
        ({"position": [7e6, 0, 0], "velocity": [0, 11e3, 0]}, "velocity: the eccentricity is 1.12"),
        ({"position": [7e6, 0, 0], "velocity": [1e3, 0, 0]}, "1000 m/s falls straight to it"),
        (
            {"position": [7e6, 0, 0], "velocity": [0, 5e3, 0]},
            "position: got 7000000 m, with .* ins",
        ),
        ({"position": [7e3, 0, 0], "velocity": [0, 7.5, 0]}, "did you mean km"),
        ({"position": [7e6, 0, 0]}, "velocity: missing beside position"),
        ({"inclination": 1.0}, "semi_major_axis: missing; or give a position and velocity"),
        (
            {"position": [7e6, 0, 0], "velocity": [0, 7.5e3, 0], "inclination": 1.0},
            "got inclination and position: an orbit has elements, a position and velocity, ",
        ),
        (
            {"position": [0, 0, 0], "velocity": [0, 7.5e3, 0]},
            "position: got the centre of the body",
        ),
        ({"semi_major_axis": 7e6, "epoch": "2026-01-01"}, "epoch: is of an orbit from a tle"),
    ],
)
def test_what_is_no_orbit_is_refused(table: dict[str, object], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Orbit(**table)
