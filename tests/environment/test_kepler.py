"""Kepler's equation and orbits, against the equation itself and Newton's two-body problem."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace.environment.constants import GM
from mjspace.environment.kepler import eccentric_anomaly
from mjspace.environment.orbit import Orbit, orbit_position


@pytest.mark.parametrize("eccentricity", [0.0, 1e-9, 0.1, 0.7, 0.99, 0.999999])
def test_eccentric_anomaly_solves_keplers_equation(eccentricity: float) -> None:
    tiny = np.logspace(-12, 0, 40)
    for mean in [*np.linspace(-10.0, 10.0, 101), *tiny, *-tiny]:
        anomaly = eccentric_anomaly(mean, eccentricity)
        turns = (mean - (anomaly - eccentricity * np.sin(anomaly))) / (2.0 * np.pi)
        assert -np.pi <= anomaly <= np.pi
        # two roundings of numbers up to 10 rad, in turns
        assert abs(turns - round(turns)) < 4e-16


def test_zero_and_half_a_turn_are_exact() -> None:
    assert eccentric_anomaly(0.0, 0.6) == 0.0
    assert abs(eccentric_anomaly(np.pi, 0.6)) == np.pi


@pytest.mark.parametrize("body", ["earth", "moon"])
def test_orbit_is_a_solution_of_the_two_body_problem(body: str) -> None:
    orbit = Orbit(
        body=body,
        semi_major_axis=2.0e7,
        eccentricity=0.4,
        inclination=1.1,
        ascending_node=-2.0,
        periapsis=0.7,
        true_anomaly=2.5,
    )
    step = 1.0  # s; a central difference of eighth order is exact to rounding here
    weights = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
    velocity = weights @ orbit_position(orbit, step * np.arange(-4, 5)) / step
    times = np.linspace(0.0, 3e4, 7)

    def motion(_: float, state: np.ndarray) -> np.ndarray:
        place = state[:3]
        return np.concatenate([state[3:], -GM[body] * place / np.linalg.norm(place) ** 3])

    start = np.concatenate([orbit_position(orbit, 0.0), velocity])
    expected = solve_ivp(motion, (0.0, 3e4), start, "DOP853", times, rtol=1e-13, atol=1e-6).y[:3].T
    # 2e7 m at 1e-16 over a step gives 5e-9 m/s, which grows to about 3 n t times as much in 3e4 s
    assert np.abs(orbit_position(orbit, times) - expected).max() < 5e-3


def test_elements_mean_what_they_say() -> None:
    polar = Orbit(semi_major_axis=1e7, eccentricity=0.2, inclination=np.pi / 2)
    node = orbit_position(polar, 0.0)
    # the periapsis, on the ascending node, on the x axis; 1 ulp of 1e7 m is 2e-9
    np.testing.assert_allclose(node, [8e6, 0.0, 0.0], atol=4e-9)
    northward = orbit_position(polar, 1.0) - node
    assert northward[2] > 0.0
    assert abs(northward[1]) < 1e-6 * northward[2]
    raised = polar.model_copy(update={"ascending_node": np.pi / 2})
    np.testing.assert_allclose(orbit_position(raised, 0.0), [0.0, 8e6, 0.0], atol=4e-9)
    later = polar.model_copy(update={"periapsis": np.pi / 2})
    np.testing.assert_allclose(orbit_position(later, 0.0), [0.0, 0.0, 8e6], atol=4e-9)
    aside = polar.model_copy(update={"true_anomaly": np.pi / 2})
    parameter = 1e7 * (1.0 - 0.2**2)
    np.testing.assert_allclose(orbit_position(aside, 0.0), [0.0, 0.0, parameter], atol=4e-9)
    beyond = polar.model_copy(update={"true_anomaly": np.pi})
    np.testing.assert_allclose(orbit_position(beyond, 0.0), [-12e6, 0.0, 0.0], atol=4e-9)


def test_position_keeps_the_shape_of_time() -> None:
    orbit = Orbit(semi_major_axis=1e7)
    times = np.arange(6.0).reshape(2, 3)
    positions = orbit_position(orbit, times)
    assert positions.shape == (2, 3, 3)
    np.testing.assert_array_equal(positions[1, 2], orbit_position(orbit, 5.0))


def test_an_orbit_through_the_planet_is_refused() -> None:
    with pytest.raises(ValueError, match=r"periapsis, 6e\+06 m .* inside the earth"):
        orbit_position(Orbit(semi_major_axis=1e7, eccentricity=0.4), 0.0)
