"""The torque-equilibrium attitude of a station: where the mean torque of an orbit is zero.

The flights of station-momentum and station-hold are judged by the numbers that are solved for here,
from the equations of gravity gradient, turning and drag alone.
"""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import root

from mjspace import attitude as att
from mjspace.contract import Array
from mjspace.environment.earth_rotation import EARTH_ROTATION
from mjspace.environment.nrlmsis import density_at
from mjspace.environment.orbit import orbit_position, orbit_velocity
from mjspace.scenario.loading import load

STATION, _ = load("station-momentum")
J = np.array(STATION.plant.vehicle_inertia)
ORBIT = STATION.environment.orbit
OFFSET = np.array([0.9884346194268309, 0.002961714817563955, 0.1515712868985661, 0.0037916159863])
FIFTH = np.linspace(22112.0, 27640.0, 73)[:-1]  # the instants of an orbit, less its last


def torques(offset: Array, time: Array) -> tuple[Array, Array, Array]:
    """Return gravity gradient and turning, and drag [N m], body axes, and its force [N], (n, 3).

    The station is at rest in the axes of the orbit, with the ``offset`` from body axes to those.
    """
    place, velocity = orbit_position(ORBIT, time), orbit_velocity(ORBIT, time)
    momentum = np.cross(place, velocity)
    distance = np.linalg.norm(place, axis=1, keepdims=True)
    n = np.linalg.norm(momentum, axis=1, keepdims=True) / distance**2
    down, left = -place / distance, -att.normalize(momentum)
    to_orbit = np.stack([np.cross(left, down), left, down], axis=1)
    to_body = att.to_matrix(offset).T @ to_orbit
    nadir, rate = (to_body @ down[..., None])[..., 0], n * (to_body @ left[..., None])[..., 0]
    rest = 3.0 * n**2 * np.cross(nadir, nadir @ J) - np.cross(rate, rate @ J)

    density, _ = density_at(
        STATION.environment.time_zero, STATION.environment.facet_drag.nrlmsis, place, time
    )
    air = velocity - np.cross([0.0, 0.0, EARTH_ROTATION], place)
    flow = (to_body @ air[..., None])[..., 0]
    force, drag = np.zeros_like(flow), np.zeros_like(flow)
    for facet in STATION.environment.facets:
        v = flow + np.cross(rate, facet.position)
        into = np.maximum(v @ facet.outward, 0.0)
        push = -0.5 * facet.drag_coefficient * facet.area * (density * into)[:, None] * v
        force, drag = force + push, drag + np.cross(facet.position, push)
    return rest, drag, force


def turned(p: Array) -> Array:
    """Return the offset of a station turned by ``p`` [rad] from the reference."""
    return att.multiply(OFFSET, att.from_rotation_vector(p))


def mean_torque(p: Array) -> Array:
    rest, drag, _ = torques(turned(p), FIFTH)
    return np.mean(rest + drag, axis=0)


def bounds_of(name: str) -> Any:
    return next(check for check in STATION.checks if check.name.startswith(name))


def test_the_checks_of_station_momentum_are_the_equilibrium() -> None:
    found = root(mean_torque, np.zeros(3), tol=1e-12)
    assert found.success
    # Drag takes the station ahead of the frame's origin, by 3/2 a t^2; its vertical is the
    # reference's. In the orbit's axes the station's own is turned back about y.
    _, _, force = torques(turned(found.x), FIFTH)
    ahead = 1.5 * np.linalg.norm(force, axis=1).mean() / STATION.plant.vehicle_mass
    behind = ahead * np.mean(FIFTH**2) / np.linalg.norm(orbit_position(ORBIT, 0.0))
    assert behind == pytest.approx(5.2e-4, rel=0.02)
    expected = found.x - [0.0, behind, 0.0]
    for name, angle in zip(("roll", "pitch", "yaw"), expected, strict=True):
        check = bounds_of(name)
        assert check.above < angle < check.below, name
        assert check.below - check.above < 2.1e-4  # 0.012 deg


def test_without_air_it_is_the_principal_axes() -> None:
    found = root(lambda p: np.mean(torques(turned(p), FIFTH)[0], axis=0), np.zeros(3), tol=1e-12)
    body = att.to_matrix(turned(found.x))
    principal = np.diag(np.linalg.eigvalsh(J)[[0, 2, 1]])
    np.testing.assert_allclose(body @ J @ body.T, principal, atol=1e-9 * np.trace(J))


def test_the_torque_of_station_hold() -> None:
    """In the orbit's own axes, where its CMGs fill."""
    level = np.array([1.0, 0.0, 0.0, 0.0])
    rest, drag, _ = torques(level, np.array([0.0]))
    n2 = 398600.4418e9 / ORBIT.semi_major_axis**3
    wanted = n2 * np.array([-3.0 * J[1, 2] - J[1, 2], 3.0 * J[0, 2], J[0, 1]])
    np.testing.assert_allclose(rest[0], wanted, rtol=1e-9, atol=1e-9)
    assert rest[0, 1] == pytest.approx(-90.17, abs=0.01)
    assert rest[0, 1] + drag[0, 1] == pytest.approx(-82.69, abs=0.02)
