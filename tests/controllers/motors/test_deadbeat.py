"""The deadbeat current loop, on motors whose currents are advanced exactly."""

import numpy as np
import pytest
from mjspace.controllers.motors.deadbeat import DeadbeatLoop

from mjspace.actuators.pmsm import Drives
from mjspace.contract import Array

POLES, R, L, KM, STEP = 6.0, 3.0, 6e-3, 2.0, 1e-4  # Table 4.1 of thesis 001, loops at 10 kHz
SPEED = np.array([0.0, 30.0, -160.0])  # rad/s: at 160, the rotor turns 0.1 rad electrical a step
P = np.full(3, POLES)
DESIRED = np.array([1.0, -2.0, 0.5])  # A


def flown(loop: DeadbeatLoop, steps: int, **motor: float) -> Array:
    """Return the currents [A] after each step, (steps, 3, 2)."""
    of_all = {"p": POLES, "R": R, "L": L, "km": KM, "limit": np.inf, "windings": 0.0}
    constants = of_all | motor
    drives = Drives(*(np.full(3, value) for value in constants.values()))
    current, memory, rows = drives.reset(), loop.reset(SPEED), []
    for _ in range(steps):
        memory, voltage = loop.step(memory, current, DESIRED, SPEED)
        current, _, _ = drives.advance(current, voltage, SPEED, STEP)
        rows.append(current)
    return np.array(rows)


def test_the_current_is_the_desired_one_after_one_period() -> None:
    rows = flown(DeadbeatLoop(P, R, L, KM, STEP), 5)
    # Rounding of voltages of 400 V: 400 x 1e-16 / (L / T) = 1e-15 A, some operations.
    np.testing.assert_allclose(rows[..., 1], np.broadcast_to(DESIRED, (5, 3)), atol=1e-13)
    np.testing.assert_allclose(rows[..., 0], 0.0, atol=1e-13)


@pytest.mark.parametrize("ratio", [0.7, 1.3])
def test_a_wrong_inductance_is_a_pole_at_one_less_its_ratio(ratio: float) -> None:
    loop = DeadbeatLoop(P, R, ratio * L, KM, STEP, correction=0.0)
    error = flown(loop, 3)[:, 0, 1] - DESIRED[0]  # the motor that stands: R alone is beside L
    # R T / L is 0.05: of that order is what the pole of L alone leaves out.
    np.testing.assert_allclose(error[1:] / error[:-1], 1.0 - ratio, atol=0.05)


def test_twice_the_inductance_is_about_where_it_is_unstable() -> None:
    stable, unstable = (
        np.abs(flown(DeadbeatLoop(P, R, k * L, KM, STEP, correction=0.0), 100)[-1]).max()
        for k in (1.9, 2.2)
    )
    assert stable < 3.0
    assert unstable > 1e5


def test_what_the_model_lacks_is_learned() -> None:
    wrong = {"R": 1.2 * R, "km": 0.95 * KM}
    without, with_it = (
        flown(DeadbeatLoop(P, R, L, KM, STEP, correction=share), 400, **wrong)[-1]
        for share in (0.0, 0.1)
    )
    expected = np.stack([np.zeros(3), DESIRED], axis=-1)
    assert np.abs(without - expected).max() > 0.1
    # 0.9^400 = 5e-19: rounding is left.
    np.testing.assert_allclose(with_it, expected, atol=1e-10)


def test_beyond_the_supply_nothing_is_learned() -> None:
    loop = DeadbeatLoop(P, R, L, KM, STEP, voltage_limit=50.0)
    after, voltage = loop.step(loop.reset(SPEED), np.zeros((3, 2)), 0.0 * DESIRED + 9.0, SPEED)
    assert np.hypot(*voltage.T).min() > 50.0
    again, _ = loop.step(after, np.zeros((3, 2)), 0.0 * DESIRED + 9.0, SPEED)
    np.testing.assert_array_equal(again[:, :2], 0.0)
