"""Detumbling by a second route: the law itself in body axes, momentum in inertial ones."""

import numpy as np
from scipy.integrate import solve_ivp

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.dipole import dipole
from mjspace.validation.benchmarks.b_dot import (
    BALL,
    BODY,
    FAST,
    FIELD,
    GAIN,
    ORBITS,
    PERIOD,
    RADIUS,
    RATE,
    STAYS,
    STRENGTH,
    STRONG,
    TUMBLE,
    averaged_rates,
    exact_rates,
    exact_tumble,
)

PHASE = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)


def field_at(time: float) -> Array:
    """Return the field [T] over the poles in the x-z plane, northward over the equator."""
    u = RATE * time
    place = RADIUS * np.array([np.cos(u), 0.0, np.sin(u)])
    return np.array(dipole(place, (0.0, 0.0, 1.0), STRENGTH))


def test_rates_are_those_of_the_law_in_body_axes() -> None:
    def slope(time: float, state: Array) -> Array:
        q, w = state[:4], state[4:]
        to_body = attitude.to_matrix(q).T
        change = (field_at(time + 0.1) - field_at(time - 0.1)) / 0.2
        field = to_body @ field_at(time)
        moment = -GAIN * (to_body @ change - np.cross(w, field))
        turning = 0.5 * attitude.multiply(q, np.append(0.0, w))
        return np.concatenate([turning, np.cross(moment, field) / BALL])

    duration = 600.0
    start = [1.0, 0.0, 0.0, 0.0, *TUMBLE]
    end = solve_ivp(slope, (0.0, duration), start, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    found = exact_rates(np.array([0.0, duration]))[-1]
    # The difference of the field is good to 8e-9 of what it does in ten minutes, 1e-4 rad/s;
    # 2e-13 measured.
    np.testing.assert_allclose(found, attitude.rotate(end[:4], end[4:]), rtol=0.0, atol=5e-12)


def test_rates_after_six_orbits_are_the_known_ones() -> None:
    rates = exact_rates(np.array([0.0, ORBITS * PERIOD]))[-1]
    # The reference's orbit, 600 km above 6371.2, is 7 s shorter: 2e-6 rad/s about y
    np.testing.assert_allclose(rates, [0.017348, 0.006123, -0.015893], rtol=0.0, atol=3e-6)
    averaged = averaged_rates(ORBITS)
    np.testing.assert_allclose(averaged, [0.017308, 0.006123, -0.015941], rtol=0.0, atol=3e-6)


def test_averages_over_an_orbit() -> None:
    fields = np.array([field_at(u / RATE) for u in PHASE]) / FIELD
    squares = np.sum(fields**2, axis=1)
    # 64 points integrate sines of up to four turns exactly
    damping = np.mean(squares[:, None] - fields**2, axis=0)
    np.testing.assert_allclose(damping, [1.375, 2.5, 1.125], rtol=1e-13)
    changes = np.array([(field_at(t + 1.0) - field_at(t - 1.0)) / 2.0 for t in PHASE / RATE])
    turning = np.mean(np.cross(fields, changes / FIELD), axis=0) / np.mean(squares)
    # differences over 2 s: (2 n)^2 / 6 of it
    np.testing.assert_allclose(turning / RATE, [0.0, -1.8, 0.0], atol=2e-6)


def test_tumble_in_a_field_that_stays() -> None:
    def slope(_: float, state: Array) -> Array:
        axes, momentum = state[:9].reshape(3, 3), state[9:]
        w = axes @ (axes.T @ momentum / BODY)
        torque = STRONG * np.cross(np.cross(w, STAYS), STAYS)
        return np.concatenate([np.cross(w, axes, axisb=0, axisc=0).ravel(), torque])

    start = np.concatenate([np.eye(3).ravel(), BODY * FAST])
    end = solve_ivp(slope, (0.0, 20.0), start, "DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    found = attitude.to_matrix(exact_tumble(np.array([0.0, 20.0]))[-1])
    # two integrations at 1e-13; 7e-13 measured
    np.testing.assert_allclose(found, end[:9].reshape(3, 3), rtol=0.0, atol=5e-12)
