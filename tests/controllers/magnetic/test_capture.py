"""Capture by the gravity gradient: what gravity-gradient-capture is judged by.

Pitch alone, I a'' + I' (a' + n) + c a' + 3/2 n^2 (Ir - Iy) sin 2a = 0, with the inertia of the boom
as it comes out, integrated apart from the simulator.
"""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace.contract import Array
from mjspace.scenario.loading import load

FLOWN, _ = load("gravity-gradient-capture")
N = 2.0 * np.pi / 5600.0  # rad/s
TIP = 2.0 * 100.0 / 102.0  # kg, reduced
BUS = 12.0 + 0.01  # kg m^2, about pitch
BETWEEN = 10.0 - 8.0  # kg m^2, of the bus: Ir - Iy without the boom
DAMPING = 0.02  # N m s/rad
DEPLOYED = 130.0  # s, some seconds after the boom has come out


def length(time: float) -> float:
    """Return the tip's distance [m]: 0.5 to 6 m at 0.05 m/s, in ramps of 10 s, from 10 s on."""
    speed, ramp, way = 0.05, 10.0, 5.5
    lasts = way / speed + ramp
    s = min(max(time - 10.0, 0.0), lasts)
    if s < ramp:
        return 0.5 + 0.5 * speed / ramp * s * s
    if s < lasts - ramp:
        return 0.5 + speed * (s - 0.5 * ramp)
    return 6.0 - 0.5 * speed / ramp * (lasts - s) ** 2


def tumble(rate: float, damping: float = DAMPING) -> Any:
    """Return the solution, pitch [rad] and momentum [N m s], from an inertial ``rate`` [rad/s]."""

    def slope(time: float, state: Array) -> list[float]:
        pitch, momentum = state
        boom = TIP * length(time) ** 2
        relative = momentum / (BUS + boom) - N
        torque = -1.5 * N * N * (BETWEEN + boom) * np.sin(2.0 * pitch)
        return [relative, torque - damping * relative]

    start = [0.0, rate * (BUS + TIP * length(0.0) ** 2)]
    return solve_ivp(
        slope, (0.0, 33600.0), start, rtol=1e-8, atol=1e-8, max_step=40, dense_output=True
    )


def energy(pitch: Array, momentum: Array) -> Array:
    """Return that of the motion about the local vertical, in that of the separatrix, deployed."""
    boom = TIP * 36.0
    kinetic = 0.5 * (BUS + boom) * (momentum / (BUS + boom) - N) ** 2
    return kinetic / (1.5 * N * N * (BETWEEN + boom)) + np.sin(pitch) ** 2


def test_the_bounds_of_the_flight_are_those_of_the_equation() -> None:
    found = tumble(0.036)
    time = np.arange(DEPLOYED, 33600.0, 2.0)
    pitch, momentum = found.sol(time)
    error = np.degrees(np.abs((pitch + np.pi) % (2.0 * np.pi) - np.pi))
    captured = time[np.argmax(energy(pitch, momentum) < 1.0)]
    assert captured == pytest.approx(4673.0, abs=2.0)
    for check in FLOWN.checks:
        window = error[(time >= check.start) & (time <= (check.end or 33600.0))]
        largest = np.radians(window.max())
        assert largest > check.above
        assert check.below is None or largest < check.below


@pytest.mark.parametrize(("rate", "half_turns"), [(0.026, 2), (0.031, 3), (0.036, 4), (0.039, 5)])
def test_captured_it_stays_the_way_up_that_its_half_turns_say(rate: float, half_turns: int) -> None:
    """Energy only falls; below the separatrix there is no way over the top."""
    found = tumble(rate)
    time = np.arange(DEPLOYED, 33600.0, 2.0)
    pitch, momentum = found.sol(time)
    left = energy(pitch, momentum)
    assert left[0] > 2.0
    assert np.diff(left).max() < 1e-7
    way_up = np.rint(pitch[-1] / np.pi)
    assert way_up == half_turns
    after = left < 1.0
    assert np.abs(pitch[after] - way_up * np.pi).max() < 0.5 * np.pi


def test_without_damping_it_tumbles_on() -> None:
    found = tumble(0.037, damping=0.0)
    pitch, momentum = found.sol(np.arange(DEPLOYED, 33600.0, 10.0))
    left = energy(pitch, momentum)
    assert np.ptp(left) < 1e-5 * left[0]
    assert pitch[-1] > 30.0 * np.pi
