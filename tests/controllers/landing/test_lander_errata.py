"""Errata of paper 003 that change a result: each test fails with the printed form."""

from dataclasses import replace

import numpy as np
import pytest
from lander_laws import FIGURE_6, LANDS, LEAST_CORRECTED, MIXED, PRINTED
from lander_oracle import Flight, Start, fly, slope_of
from mjspace.controllers.landing import lander_lqr as lqr
from mjspace.controllers.landing.descent import SineDescent
from mjspace.controllers.landing.lander import euler

from mjspace.contract import Array

SINE = SineDescent(stance=0.0)


def climb_error(flight: Flight, time: float) -> float:
    return float(flight.error[round(time / 0.02), 2])


def most_tilt(flight: Flight) -> float:
    return float(np.degrees(flight.tilt.max()))


def test_the_printed_law_falls_and_tumbles() -> None:
    flight = fly(PRINTED, SINE, duration=34.0)
    assert flight.error[-1, 2] < -960.0
    assert most_tilt(flight) > 90.0


def test_thrust_is_about_the_equilibrium() -> None:
    """M1, erratum 9: with F = -S1 - psi1 it would take 512 m of error to hold the weight."""
    printed = fly(replace(LEAST_CORRECTED, equilibrium_thrust=0.0), SINE, duration=34.0)
    assert climb_error(printed, 34.0) < -512.0
    assert abs(climb_error(fly(LEAST_CORRECTED, SINE, duration=34.0), 34.0)) < 70.0


def test_third_axis_has_its_own_sign() -> None:
    """M2, erratum 10: with k3 = +2 its rate runs away, w3' = (Fe / Jz) 2 w3."""
    positive = np.array([1.0, 14.0, 2.0])
    printed = fly(replace(LEAST_CORRECTED, surface_gain=positive), SINE, duration=34.0)
    assert most_tilt(printed) > 90.0
    assert most_tilt(fly(LEAST_CORRECTED, SINE, duration=34.0)) < 23.0


def test_azimuth_counts_as_much_as_it_moves_the_vehicle() -> None:
    """M3, erratum 16: K is made for r = re, and unscaled it is too strong by re/r."""
    printed = fly(replace(LEAST_CORRECTED, coordinates="polar"), SINE, duration=140.0)
    assert climb_error(printed, 140.0) == pytest.approx(-375.0, abs=10.0)
    mixed = fly(replace(MIXED, coordinates="polar"), SINE, duration=172.0)
    assert np.degrees(mixed.gimbal[0, 0]) == pytest.approx(-174.0, abs=0.5)  # a reversed engine
    wide = (np.abs(np.degrees(mixed.gimbal)).max(axis=1) > 10.0) & (mixed.time > 5.0)
    assert mixed.time[wide][0] == pytest.approx(164.0, abs=1.0)
    assert np.degrees(mixed.tilt[-1]) > 40.0


def test_gains_of_axes_are_turned_before_they_are_mixed() -> None:
    """M5, erratum 14: the vehicle rolls at 0.5 or 5 deg/s, which no torque can stop."""

    def miss(mixes: bool, roll: float) -> float:
        start = Start(rate=(np.radians(roll), 0.0, 0.0))
        law = replace(LANDS, mixes_before_turning=mixes)
        return float(np.abs(fly(law, SINE, duration=200.0, start=start).error[-1]).max())

    assert miss(mixes=True, roll=5.0) < 0.8  # 0.7 m, as without roll
    assert miss(mixes=False, roll=0.5) > 20.0
    assert miss(mixes=False, roll=5.0) > 1000.0


def test_the_gain_is_that_of_its_weights_but_for_a_row() -> None:
    found = lqr.lqr_gain()
    recomputed = np.zeros((3, 7))
    recomputed[0, 6] = 0.31623
    recomputed[1, [1, 2, 5]] = -14.1421, 1062.914, -1.31914
    recomputed[2, [0, 3, 4]] = 0.00100, -0.021854, 0.374076
    np.testing.assert_allclose(found, recomputed, rtol=2e-5, atol=1e-6)  # as many digits are given
    upright = lqr.PRINTED * [[1.0], [1.0], [-1.0]]  # erratum 10
    np.testing.assert_allclose(found, upright, rtol=0.008, atol=1e-6)  # erratum 11: cut digits
    assert not np.allclose(found, lqr.PRINTED, rtol=0.1, atol=1e-6)


def test_the_printed_gain_is_unstable_on_the_papers_own_model() -> None:
    a, b = lqr.controllable_part()
    assert np.linalg.eigvals(a - b @ lqr.PRINTED).real.max() == pytest.approx(0.458, abs=1e-3)
    poles = np.linalg.eigvals(a - b @ lqr.lqr_gain())
    wanted = [-1.177, -0.316, -0.265, -0.119, -0.0546 - 0.0553j, -0.0546 + 0.0553j, -0.0228]
    np.testing.assert_allclose(np.sort_complex(poles), np.sort_complex(wanted), atol=5e-4)


def test_the_recomputed_gain_flies_alike() -> None:
    """The printed digits are cut by up to 0.8 %."""
    printed, recomputed = (
        fly(replace(FIGURE_6, recomputed=choice), SINE, duration=60.0) for choice in (False, True)
    )
    assert 0.01 < np.abs(printed.position - recomputed.position).max() < 0.5  # 0.40 m


def test_the_controllable_part_follows_from_the_printed_transformation() -> None:
    """Erratum 12: T itself says z7 = gammaL and z8 = -phiL; 13: the rest drifts."""
    # x, r, theta, r', theta', alpha, phiL, gammaL, w1
    a, half, root = np.zeros((9, 9)), 0.5, np.sqrt(0.5)
    a[1, 3] = a[2, 4] = a[5, 8] = 1.0
    a[3, 7], a[4, 6], a[5, 4] = 1.6, -1.6e-4, -1.0
    b = np.zeros((9, 3))
    b[0, 0] = b[6, 1] = b[7, 2] = 1.0
    t = np.zeros((9, 9))
    t[0, [2, 5, 8]] = half, half, -root
    t[1, [2, 5, 8]] = half, half, root
    t[3, [2, 5]] = root, -root
    t[2, 1] = t[6, 7] = t[8, 0] = 1.0
    t[4, 4] = t[5, 3] = t[7, 6] = -1.0
    np.testing.assert_allclose(t @ t.T, np.eye(9), atol=1e-15)
    z, expected = t @ a @ t.T, lqr.controllable_part()
    np.testing.assert_allclose(z[2:, 2:], expected[0], atol=1e-15)
    np.testing.assert_allclose((t @ b)[2:], expected[1], atol=1e-15)
    uncontrolled = 2.0**-1.5 * np.array([[-1.0, 1.0], [-1.0, 1.0]])  # printed with the other sign
    np.testing.assert_allclose(z[:2, :2], uncontrolled, atol=1e-15)
    assert not np.any((t @ b)[:2])


def passive(axis: int, angle: float) -> Array:
    """Return the paper's Rx, Ry or Rz: components of a fixed vector in axes turned by ``angle``."""
    matrix, (i, j) = np.eye(3), ((axis + 1) % 3, (axis + 2) % 3)
    matrix[[i, j], [i, j]] = np.cos(angle)
    matrix[i, j], matrix[j, i] = np.sin(angle), -np.sin(angle)
    return matrix


def random_state(rng: np.random.Generator) -> Array:
    """Return a state of the oracle, far enough from r = 0."""
    q = rng.normal(size=4)
    place, speed = rng.uniform(500.0, 2500.0, 3), rng.uniform(-30.0, 30.0, 3)
    engine = [rng.uniform(50.0, 320.0), *rng.uniform(-0.3, 0.3, 2), 0.0]
    return np.array([*place, *speed, *(q / np.linalg.norm(q)), *rng.normal(size=3), *engine])


@pytest.mark.parametrize("seed", range(5))
def test_cylindrical_equations_hold_in_local_axes(seed: int) -> None:
    """M4, erratum 1: R of (1)-(3) has the argument alpha, and alpha + theta in inertial axes."""
    y = random_state(np.random.default_rng(seed))
    slope = slope_of(y)
    (h, Y, Z), (_, vY, vZ), (aX, aY, aZ) = y[:3], y[3:6], slope[3:6]
    X = 1.738e6 + h
    r, theta = np.hypot(Y, Z), np.arctan2(Z, Y)
    c, s = np.cos(theta), np.sin(theta)
    away, turn = c * vY + s * vZ, (c * vZ - s * vY) / r
    acceleration = [aX, c * aY + s * aZ + r * turn**2, (c * aZ - s * aY - 2.0 * away * turn) / r]
    psi, phi, gamma = euler(y[[6, 8, 9, 7]])
    F, b1, b2 = y[13:16]
    thrust = F * np.array([np.cos(b1) * np.cos(b2), np.cos(b1) * np.sin(b2), np.sin(b1)]) / 100.0
    pull = 4.902e12 / (X * X + r * r) ** 1.5

    def by(roll: float) -> Array:
        local = (passive(2, gamma) @ passive(1, phi) @ passive(0, roll)).T @ thrust
        gravity = -pull * np.array([X, r, 0.0])
        inertial = [0.0, r * turn**2, -2.0 * away * turn]
        return (gravity + local + inertial) / [1.0, 1.0, r]

    weights = np.array([1.0, 1.0, r])  # m/s^2
    np.testing.assert_allclose(by(psi - theta) * weights, acceleration * weights, atol=1e-9)
    assert np.abs((by(psi) - acceleration) * weights).max() > 0.05


@pytest.mark.parametrize("seed", range(5))
def test_rates_of_the_angles(seed: int) -> None:
    """Erratum 2: three signs of the printed W, with the angles that the law takes."""
    y = random_state(np.random.default_rng(seed))
    slope, h = slope_of(y), 1e-6
    ahead, behind = (euler((y + s * h * slope)[[6, 8, 9, 7]]) for s in (1.0, -1.0))
    rates = np.subtract(ahead, behind) / (2.0 * h)
    _, phi, gamma = euler(y[[6, 8, 9, 7]])
    cg, sg, cp, sp = np.cos(gamma), np.sin(gamma), np.cos(phi), np.sin(phi)
    w = np.array([[cg * cp, sg, 0.0], [-sg * cp, cg, 0.0], [sp, 0.0, 1.0]])
    printed = np.array([[cg * cp, -sg, 0.0], [sg * cp, cg, 0.0], [-sp, 0.0, 1.0]])
    np.testing.assert_allclose(w @ rates, y[10:13], atol=1e-6 / cp)  # central differences
    assert np.abs(printed @ rates - y[10:13]).max() > 0.01
