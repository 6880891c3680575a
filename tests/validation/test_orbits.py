"""Ellipses against Newton's equation, Hill's motion against its own and against ellipses."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from mjspace.contract import Array
from mjspace.environment.orbit import Orbit
from mjspace.validation.benchmarks.orbits import (
    BESIDE,
    BODY,
    CIRCLE,
    DRIFTS,
    FRAME,
    MU,
    PERIOD,
    RATE,
    coast,
    hill,
    state,
)

TIME = np.linspace(0.0, 16e3, 9)


@pytest.mark.parametrize("orbit", [FRAME, BODY], ids=["frame", "body"])
def test_state_has_the_orbits_elements(orbit: Orbit) -> None:
    place, velocity = state(orbit)
    momentum = np.cross(place, velocity)
    towards_periapsis = np.cross(velocity, momentum) / MU - place / np.linalg.norm(place)
    node = np.cross([0.0, 0.0, 1.0], momentum)
    tilt = np.arctan2(np.linalg.norm(node), momentum[2])

    def turn(first: Array, second: Array) -> float:
        up = momentum / np.linalg.norm(momentum)
        return float(np.arctan2(np.cross(first, second) @ up, first @ second))

    energy = 0.5 * velocity @ velocity - MU / np.linalg.norm(place)
    # rounding, of angles divided by the eccentricity
    assert -0.5 * MU / energy == pytest.approx(orbit.semi_major_axis, rel=1e-14)
    assert np.linalg.norm(towards_periapsis) == pytest.approx(orbit.eccentricity, rel=1e-14)
    assert tilt == pytest.approx(orbit.inclination, rel=1e-14)
    assert np.arctan2(node[1], node[0]) == pytest.approx(orbit.ascending_node, rel=1e-14)
    assert turn(node, towards_periapsis) == pytest.approx(orbit.periapsis, rel=1e-14)
    assert turn(towards_periapsis, place) == pytest.approx(orbit.true_anomaly, rel=1e-14)


def test_coasting_solves_newtons_equation() -> None:
    def motion(_: float, at: Array) -> Array:
        return np.concatenate([at[3:], -MU * at[:3] / np.linalg.norm(at[:3]) ** 3])

    start = np.concatenate(state(BODY))
    wanted = solve_ivp(motion, TIME[[0, -1]], start, "DOP853", TIME, rtol=1e-13, atol=1e-9).y.T
    places, velocities = coast(start[:3], start[3:], TIME)
    # 1e-13 a step of 8500 km, growing along the orbit; 1e-5 m measured
    np.testing.assert_allclose(places, wanted[:, :3], rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(velocities, wanted[:, 3:], rtol=0.0, atol=1e-7)


def test_an_ellipse_closes_after_its_known_period() -> None:
    start = state(Orbit(semi_major_axis=8.5e6, eccentricity=0.2))
    end = coast(*start, np.array([7799.00806]))  # 2 pi sqrt(a^3 / GM)
    # at 9 km/s the period's last digit, 5e-6 s, is 0.05 m
    assert np.linalg.norm(end[0][0] - start[0]) < 0.05


def test_hills_motion_solves_hills_equations() -> None:
    n = RATE
    A = np.zeros((6, 6))
    A[:3, 3:] = np.eye(3)
    A[3, 0], A[3, 4], A[4, 3], A[5, 2] = 3.0 * n**2, 2.0 * n, -2.0 * n, -(n**2)
    beside, drifts = np.array([10.0, -20.0, 30.0]), np.array([0.03, 0.02, -0.01])
    time = np.linspace(0.0, 2.0 * PERIOD, 9)
    start = np.concatenate([beside, drifts])
    wanted = np.array([(expm(t * A) @ start)[:3] for t in time])
    # rounding of a kilometre; 1e-11 measured
    np.testing.assert_allclose(hill(beside, drifts, time), wanted, rtol=0.0, atol=1e-10)


def test_drift_in_one_orbit_is_the_known_one() -> None:
    end = hill(BESIDE, DRIFTS, np.array([PERIOD]))[0]
    assert end[1] == pytest.approx(-2058.69109, abs=5e-6)  # its digits
    assert end[1] == pytest.approx(-12.0 * np.pi * 100.0 + 6.0 * np.pi * 0.1 / RATE, rel=1e-14)
    np.testing.assert_allclose(end[[0, 2]], BESIDE[[0, 2]], rtol=1e-13)


def test_hills_motion_is_what_two_ellipses_do_at_first() -> None:
    place, velocity = state(CIRCLE)
    half = np.array([0.5 * PERIOD])

    def apart(scale: float) -> Array:
        x, y, z = scale * BESIDE
        moving = velocity + scale * DRIFTS + RATE * np.array([-y, x, 0.0])
        there = (
            coast(place + np.array([x, y, z]), moving, half)[0] - coast(place, velocity, half)[0]
        )
        return there[0] * [-1.0, -1.0, 1.0]  # half a turn on

    even = [np.linalg.norm(apart(s) + apart(-s)) for s in (10.0, 1.0)]
    assert even[0] / even[1] == pytest.approx(100.0, rel=1e-3)  # next: the offset over the radius
    # what is of third order is 1e-9 of the kilometre; 4e-6 measured
    odd = 0.5 * (apart(1.0) - apart(-1.0))
    np.testing.assert_allclose(odd, hill(BESIDE, DRIFTS, half)[0], rtol=0.0, atol=1e-5)
