"""The truth of the boom benchmarks, by second routes."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace import attitude
from mjspace.contract import Array
from mjspace.validation.benchmarks import boom

TIMES = np.linspace(0.0, boom.DURATION, 41)


def test_spin_meets_the_reference() -> None:
    rate, angle = boom.exact_spin(np.array([0.0, boom.DURATION]))
    assert rate == pytest.approx([1.0, 0.2391304348], abs=1e-10)  # the reference's digits
    assert angle == pytest.approx([0.0, 10.84555096], abs=1e-8)
    assert boom.exact_work() == pytest.approx(-4.184783, abs=1e-6)


def test_spin_meets_an_integration_of_force_and_torque() -> None:
    # Newton for a tip: the tube pushes it sideways with m (2 r' w + r w'); the bus feels r times
    # that, twice.  The drives pull with m r w^2, and work with the rate of deployment.
    def slope(time: float, state: Array) -> list[float]:
        _, w, r, v, _ = state
        grip = -4.0 * boom.TIP * r * v * w / (boom.INERTIA[2] + 2.0 * boom.TIP * r * r)
        return [w, grip, v, 0.0, -2.0 * boom.TIP * r * w * w * v]

    begin = [0.0, boom.SPIN[2], boom.STOWED, boom.PACE, 0.0]
    end = solve_ivp(slope, (0.0, boom.DURATION), begin, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    rate, angle = boom.exact_spin(np.array([boom.DURATION]))
    # 1e-13 a step of DOP853, some hundred steps.
    assert end[:3] == pytest.approx([angle[0], rate[0], boom.length(TIMES[-1:])[0]], rel=1e-11)
    assert end[4] == pytest.approx(boom.exact_work(), rel=1e-11)


def test_nutation_keeps_momentum_in_space() -> None:
    rates, attitudes = boom.exact_nutation(TIMES)
    far = 2.0 * boom.TIP * boom.length(TIMES)[:, None] ** 2
    momentum = attitude.rotate(attitudes, (boom.INERTIA + far * [0.0, 1.0, 1.0]) * rates)
    # It is no equation that was integrated, so it holds as well as the integration: 1e-13 a step.
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], (41, 3)), atol=1e-10)
    assert np.linalg.norm(rates[-1]) < 0.4 * np.linalg.norm(rates[0])


def test_nutation_without_a_nutation_is_the_spin(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(boom, "NUTATION", boom.SPIN)
    rates, attitudes = boom.exact_nutation(TIMES)
    rate, angle = boom.exact_spin(TIMES)
    np.testing.assert_allclose(rates, rate[:, None] * [0.0, 0.0, 1.0], atol=1e-11)
    level = attitude.from_rotation_vector(angle[:, None] * np.array([0.0, 0.0, 1.0]))
    assert attitude.rotation_angle(attitudes, level).max() < 1e-10
