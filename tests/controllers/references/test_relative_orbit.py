"""Relative orbits: the Clohessy-Wiltshire equations, and derivatives in inertial axes."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.references.relative_orbit import RelativeOrbit
from orbit_samples import ephemeris

from mjspace import attitude as att
from mjspace.contract import Array

RATE = 1.1219973762820691e-3
TIME = np.linspace(0.0, 6000.0, 25)
TILTED = att.from_rotation_vector(np.array([0.5, -0.8, 0.3]))


def thrust(orbit: RelativeOrbit, time: Array) -> Array:
    """Return the acceleration that the motion needs beyond the tide, Hill's axes [m/s^2]."""
    at = orbit.at(time)
    up = att.rotate(at.attitude, np.array([1.0, 0.0, 0.0]))
    height = np.sum(up * at.position, axis=-1, keepdims=True)
    natural = RATE**2 * (3.0 * height * up - at.position)
    return att.rotate(att.conjugate(at.attitude), at.linear_acceleration - natural)


@pytest.mark.parametrize("attitude", [np.array([1.0, 0.0, 0.0, 0.0]), TILTED])
def test_a_football_orbit_needs_no_thrust(attitude: Array) -> None:
    orbit = RelativeOrbit(
        RATE, np.array([0.0, 250.0, 0.0]), 50.0, 0.4, 30.0, 1.1, start_attitude=attitude
    )
    assert np.abs(thrust(orbit, TIME)).max() < 1e-12 * 250.0 * RATE  # rounding


def test_a_place_needs_three_times_n_squared_down_and_n_squared_across() -> None:
    needed = thrust(RelativeOrbit(RATE, np.array([100.0, 40.0, 20.0])), TIME)
    assert needed == pytest.approx(np.tile(RATE**2 * np.array([-300.0, 0.0, 20.0]), (25, 1)))


@pytest.mark.parametrize("keys", [{}, {"height": 50.0, "across": 30.0, "phase": 0.7}])
def test_velocity_and_acceleration_are_the_derivatives(keys: dict[str, Any]) -> None:
    orbit = RelativeOrbit(RATE, np.array([10.0, 20.0, 30.0]), start_attitude=TILTED, **keys)
    h = 1.0  # [s]: an error of n^2 h^2 / 6
    before, now, after = (orbit.at(TIME + dt) for dt in (-h, 0.0, h))
    assert np.allclose((after.position - before.position) / (2 * h), now.velocity, atol=1e-7)
    assert np.allclose(
        (after.velocity - before.velocity) / (2 * h), now.linear_acceleration, atol=1e-10
    )
    turned = att.multiply(att.conjugate(before.attitude), after.attitude)
    assert np.allclose(att.to_rotation_vector(turned) / (2 * h), now.rate)


def test_left_out_the_rate_and_the_axes_are_those_of_the_scenarios_orbit() -> None:
    known = ephemeris("inclined")
    found = RelativeOrbit(center=np.array([10.0, 20.0, 30.0]), ephemeris=known).at(TIME)
    at = known.origin(TIME)
    up, normal = att.normalize(at.position), att.normalize(np.cross(at.position, at.velocity))
    # 3e-12 measured, by the rounding of the mean anomaly.
    place = 10.0 * up + 20.0 * np.cross(normal, up) + 30.0 * normal
    np.testing.assert_allclose(found.position, place, atol=1e-10)
    np.testing.assert_allclose(att.rotate(found.attitude, np.array([0.0, 0.0, 1.0])), normal)
    rate = np.sqrt(3.986004418e14 / 7.2e6**3)
    np.testing.assert_allclose(found.rate, np.tile([0.0, 0.0, rate], (25, 1)), rtol=1e-12)


@pytest.mark.parametrize("orbit", ["eccentric", "drifting"])
def test_an_orbit_that_is_no_circle_has_no_such_rate(orbit: str) -> None:
    with pytest.raises(ValueError, match=r"orbit_rate: missing, .* no constant one"):
        RelativeOrbit(ephemeris=ephemeris(orbit)).at(TIME)


def test_without_orbit_and_rate_it_is_refused() -> None:
    with pytest.raises(ValueError, match="orbit_rate: missing"):
        RelativeOrbit().at(TIME)
