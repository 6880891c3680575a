"""The observers' errors obey their equations under any motion; figures at 1 ms halve with it."""

import numpy as np
import pytest
from mjspace.controllers.attitude.immersion_invariance_observers import (
    DisturbanceObserver,
    RateObserver,
)
from mjspace.controllers.references.references import MultiAxis
from oracle import Flight
from paper_satellite import AXES, JW, P_R, H, flight, peak

from mjspace import attitude as att

D = np.array([0.3, -0.2, 0.5])


def test_error_of_the_disturbance_decays_at_the_observer_gain() -> None:
    errors = []
    for period in (1e-3, 0.5e-3):
        law = DisturbanceObserver(H, AXES, JW, control_period=period, observer_gain=2.0)
        of = flight(law, MultiAxis(), 3.0, period=period, disturbance=D)
        exact = -D * np.exp(-2.0 * of.time)[:, None]
        errors.append(peak(of.signals["disturbance"] - D - exact))
    assert errors[0] == pytest.approx(3.7e-4, rel=0.1)
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.1)
    # z' = -Gamma z - H^-1 error: nothing is left of the disturbance.
    assert peak(of.signals["z"][-1]) < 5e-4


def test_without_the_observer_the_disturbance_stays() -> None:
    law = DisturbanceObserver(H, AXES, JW, control_period=1e-3, observer_gain=1e-9)
    of = flight(law, MultiAxis(), 3.0, disturbance=D)
    # z = H^-1 d / Gamma
    np.testing.assert_allclose(of.signals["z"][-1], np.linalg.solve(H, D) / 5.0, atol=2e-4)


def observed(period: float) -> tuple[Flight, RateObserver]:
    law = RateObserver(H, AXES, JW, control_period=period)
    return flight(law, MultiAxis(), 5.0, period=period, w0=np.array([0.2, -0.142, 0.0])), law


def test_observed_rate_converges() -> None:
    left = []
    for period in (1e-3, 0.5e-3):
        of, _ = observed(period)
        error = np.linalg.norm(of.signals["estimated_rate"] - of.rate, axis=1)
        assert error[0] == pytest.approx(0.245, abs=1e-3)  # it starts from an estimate of rest
        left.append(error[of.time > 4.5].max())
    assert left[0] < 3e-4  # 2e-4: the rate changes while the torque is held
    assert left[0] / left[1] == pytest.approx(2.0, abs=0.2)


def test_lyapunov_function_of_the_rate_observer_decreases_as_derived() -> None:
    """V' = -l1 |eps_v|^2, V = 2 (1 - eps_0) + |hI_o - hI|^2 / (2 l2 c^2)."""
    of, law = observed(0.5e-3)
    eps = att.multiply(att.conjugate(of.states["attitude"]), of.attitude)
    c = np.trace(H + 0.05 * np.eye(3)) / 3.0
    h = of.states["momentum"] - P_R
    V = 2.0 * (1.0 - np.abs(eps[:, 0])) + (h**2).sum(1) / (2.0 * law.momentum_injection * c**2)
    power = law.attitude_injection * (eps[:, 1:] ** 2).sum(1)
    lost = np.cumsum(power) * 0.5e-3
    np.testing.assert_allclose(V[0] - V[1:], lost[:-1], atol=0.02 * V[0])
    assert V[-1] < 1e-4 * V[0]


def test_rate_observer_reads_no_rate() -> None:
    of, law = observed(1e-3)
    blind = flight(law, MultiAxis(), 0.05, rate_noise=np.full((51, 3), np.nan),
                   w0=np.array([0.2, -0.142, 0.0]))  # fmt: skip
    np.testing.assert_array_equal(blind.torque, of.torque[:51])
