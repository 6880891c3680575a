"""The truths of the wheel benchmarks, by second routes."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace import attitude
from mjspace.validation.benchmarks import wheels


def test_spin_up_is_what_the_two_equations_of_motion_give() -> None:
    # Bus and wheel about one axis, absolute rates: Ib w' = -tau, Jw (w + Omega)' = tau.
    tau, bus, wheel = wheels.TORQUE, wheels.BUS[2], wheels.AXIAL

    def derivative(_: float, y: list[float]) -> list[float]:
        return [-tau / bus, tau / wheel, y[0], tau * (y[1] - y[0])]

    y = solve_ivp(derivative, (0.0, 20.0), [0.0] * 4, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    rate, speed, angle, work = (part[0] for part in wheels.exact_spin_up(np.array([20.0])))
    # A parabola: the integration has rounding alone.
    np.testing.assert_allclose([rate, rate + speed, angle, work], y, rtol=1e-13)


def test_spin_up_of_the_textbook_case(monkeypatch: pytest.MonkeyPatch) -> None:
    # Worked by hand: 0.2 N m for 20 s on 10 kg m^2 and 0.01 kg m^2.
    monkeypatch.setattr(wheels, "BUS", np.full(3, 10.0))
    exact = [part[0] for part in wheels.exact_spin_up(np.array([20.0]))]
    np.testing.assert_allclose(exact, [-0.4, 400.4, -4.0, 800.8], rtol=1e-14)


def test_gyrostat_after_ten_seconds() -> None:
    # Digits of an integration of the same motion in another program, given to ten places.
    rates, attitudes = wheels.exact_gyrostat(np.array([0.0, 10.0]))
    np.testing.assert_allclose(
        rates[1], [0.0040814223, -0.0234018027, 0.0299547893], rtol=0.0, atol=6e-11
    )
    np.testing.assert_allclose(
        attitudes[1],
        [0.9883202606, -0.0049088538, 0.0067965192, 0.152160353],
        rtol=0.0,
        atol=6e-11,
    )


def test_gyrostat_keeps_momentum_and_energy_for_the_whole_flight() -> None:
    # Neither is used by the integration.  The attitude may be off by 1e-12 rad or so after 12 000
    # evaluations at 1e-13, a hundredth of what the benchmark measures.
    time = np.linspace(0.0, 1000.0, 101)
    rates, attitudes = wheels.exact_gyrostat(time)
    wheel = wheels.AXIAL * (wheels.SPEED + wheels.RATE[2]) * np.array([0.0, 0.0, 1.0])
    momentum = attitude.rotate(attitudes, wheels.BUS * rates + wheel)
    of_bus = np.linalg.norm(wheels.BUS * wheels.RATE)
    assert np.abs(momentum - momentum[0]).max() < 3e-11 * of_bus
    energy = 0.5 * rates**2 @ wheels.BUS
    np.testing.assert_allclose(energy, energy[0], rtol=1e-11)
