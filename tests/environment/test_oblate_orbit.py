"""An orbit by position and velocity under J2: an integration of another kind, and what is kept."""

import numpy as np
import pytest

from mjspace.contract import Array
from mjspace.environment import kepler, oblate_orbit
from mjspace.environment.constants import GM, J2, RADIUS
from mjspace.environment.orbit import Orbit, orbit_position, orbit_velocity

STATES = {  # m, m/s
    "polar": ((7e6, 0.0, 0.0), (0.0, 1e3, 7.47e3)),
    "Molniya": ((6.9e6, 0.0, 1e5), (0.0, 4.5e3, 8.9e3)),  # e = 0.72
    "geostationary": ((42164e3, 0.0, 0.0), (0.0, 3074.66, 0.0)),
    "retrograde": ((0.0, 6.8e6, 1e6), (7.4e3, 0.0, -1.2e3)),
    "equatorial circle": ((7e6, 0.0, 0.0), (0.0, 7546.05, 0.0)),
}
PLACES, VELOCITIES = (np.array(part) for part in zip(*STATES.values(), strict=True))
ORBITS = {
    name: Orbit(position=list(place), velocity=list(velocity), j2=True)
    for name, (place, velocity) in STATES.items()
}


def potential(place: Array) -> Array:
    """Return the potential [m^2/s^2], by the Legendre polynomial of the latitude's sine."""
    distance2 = np.sum(place**2, axis=-1)
    flat = J2["earth"] * RADIUS["earth"] ** 2 / distance2
    legendre = 1.5 * place[..., 2] ** 2 / distance2 - 0.5
    return -GM["earth"] / np.sqrt(distance2) * (1.0 - flat * legendre)


def acceleration(place: Array) -> Array:
    """Return less the gradient of the potential, by complex steps, which are exact."""
    step = 1e-20
    shifted = place + 1j * step * np.eye(3)[:, None]
    return -(potential(shifted).imag / step).T


def test_it_is_the_motion_that_a_plain_integration_has() -> None:
    place, velocity, step, steps = PLACES, VELOCITIES, 5.0, 4000
    for _ in range(steps):
        a1 = acceleration(place)
        v2 = velocity + 0.5 * step * a1
        a2 = acceleration(place + 0.5 * step * velocity)
        v3 = velocity + 0.5 * step * a2
        a3 = acceleration(place + 0.5 * step * v2)
        v4 = velocity + step * a3
        a4 = acceleration(place + step * v3)
        place = place + step / 6.0 * (velocity + 2.0 * v2 + 2.0 * v3 + v4)
        velocity = velocity + step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    end = step * steps
    for orbit, there, speed in zip(ORBITS.values(), place, velocity, strict=True):
        # RK4's 5 mm; at a quarter of the step 2e-4 m, and ours is off by less. J2 moves it by 2 km
        # in the geostationary orbit and by 100 to 430 km in the others.
        np.testing.assert_allclose(orbit_position(orbit, end), there, atol=0.02)
        np.testing.assert_allclose(orbit_velocity(orbit, end), speed, atol=2e-5)


@pytest.mark.parametrize("name", STATES)
def test_energy_and_polar_momentum_are_kept_for_a_day(name: str) -> None:
    time = np.linspace(-6000.0, 86400.0, 300)
    place, velocity = orbit_position(ORBITS[name], time), orbit_velocity(ORBITS[name], time)
    energy = 0.5 * np.sum(velocity**2, axis=1) + potential(place)
    momentum = np.cross(place, velocity)[:, 2]
    # a relative tolerance of 1e-12 over some 1000 steps; 1.1e-11 measured
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-10
    assert np.abs(momentum - momentum[0]).max() < 1e-10 * np.linalg.norm(
        np.cross(place[0], velocity[0])
    )


def test_it_begins_at_the_state_that_was_given() -> None:
    for orbit, place, velocity in zip(ORBITS.values(), PLACES, VELOCITIES, strict=True):
        # rounding of elements of 7e6 m (42e6 m) and back
        np.testing.assert_allclose(orbit_position(orbit, 0.0), place, atol=1e-7)
        np.testing.assert_allclose(orbit_velocity(orbit, 0.0), velocity, atol=1e-10)
        still = orbit.model_copy(update={"j2": False})
        np.testing.assert_array_equal(orbit.elements()[1:], still.elements()[1:])


def test_a_place_is_the_same_whatever_was_asked_for_before() -> None:
    times = np.array([25000.0, -100.0, 3.0, 12000.0])
    found = [orbit_position(ORBITS["polar"], times)]
    for order in (times, times[::-1]):
        oblate_orbit._pieces.cache_clear()
        alone = [orbit_position(ORBITS["polar"], np.array([time]))[0] for time in order]
        found.append(np.array(alone if order is times else alone[::-1]))
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])


def test_the_orbit_of_an_instant_touches_the_motion() -> None:
    """Its pull is that of the oblate Earth there, along the radius."""
    orbit, time = ORBITS["polar"], np.array([4000.0])
    (row,) = orbit.rows(time)
    place = np.array(kepler.position(row, time[0]))
    up = place / np.linalg.norm(place)
    radial = float(acceleration(place[None])[0] @ up)
    assert row[0] / (place @ place) == pytest.approx(-radial, rel=1e-12)
