"""The closed form of nutation against Euler's equations, integrated."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace import attitude
from mjspace.contract import Array
from mjspace.validation.benchmarks.nutation import AXIAL, RATE, TRANSVERSE, exact

INERTIA = np.array([TRANSVERSE, TRANSVERSE, AXIAL])
TIME = np.linspace(0.0, 60.0, 61)


def test_closed_form_solves_eulers_equations() -> None:
    def slope(_: float, state: Array) -> Array:
        q, w = state[:4], state[4:]
        turning = 0.5 * attitude.multiply(q, np.append(0.0, w))
        return np.concatenate([turning, np.cross(INERTIA * w, w) / INERTIA])

    start = np.concatenate([[1.0, 0.0, 0.0, 0.0], RATE])
    end = solve_ivp(slope, (0.0, 20.0), start, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    rates, attitudes = exact(np.array([20.0]))
    # DOP853 leaves 1e-12 over three turns at that tolerance.
    assert attitude.rotation_angle(attitudes[0], end[:4]) < 1e-11
    np.testing.assert_allclose(rates[0], end[4:], rtol=0.0, atol=1e-11)


def test_nutation_and_precession_have_their_known_rates() -> None:
    rates, attitudes = exact(TIME)
    phase = np.unwrap(np.arctan2(rates[:, 1], rates[:, 0]))
    np.testing.assert_allclose(phase, 0.4 * TIME, rtol=0.0, atol=1e-13)

    momentum = attitude.rotate(attitudes, INERTIA * rates)
    np.testing.assert_allclose(momentum - INERTIA * RATE, 0.0, atol=1e-13)
    unit = momentum[0] / np.linalg.norm(momentum[0])
    axis = attitude.rotate(attitudes, np.array([0.0, 0.0, 1.0]))
    angle = np.arccos(axis @ unit)
    np.testing.assert_allclose(angle, np.radians(8.1301023542), rtol=1e-10)  # its digits
    # At sqrt(2) rad/s: the axis is back where it was after each precession, and only then.
    turns = exact(np.arange(4) * 2.0 * np.pi / np.sqrt(2.0))[1]
    back = attitude.rotate(turns, np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(back - axis[0], 0.0, atol=1e-14)
    assert np.linalg.norm(momentum[0]) / TRANSVERSE == pytest.approx(np.sqrt(2.0), rel=1e-15)
