"""Laws without a rate measurement: the adaptive one and the contraction law at an observed rate."""

from functools import cache

import numpy as np
import pytest
from mjspace.controllers.attitude.adaptive_output_feedback import OutputFeedback
from mjspace.controllers.attitude.adaptive_tracking import Passivity
from mjspace.controllers.attitude.contraction_output_feedback import OutputFeedback as Contraction
from mjspace.controllers.references.references import Sweep
from oracle import Flight
from paper_satellite import AXES, JW, P_R, H, flight, peak

from mjspace import attitude as att
from mjspace.contract import Measurement, Reference

W0 = np.array([0.2, -0.142, 0.0])
ADAPTIVE = OutputFeedback(control_period=1e-3, wheel_axes=AXES, wheel_inertia=JW)
CONTRACTION = Contraction(
    inertia=H, wheel_axes=AXES, wheel_inertia=JW, control_period=1e-3, attitude_gain=5.0,
    attitude_injection=40.0, momentum_injection=800.0,
)  # fmt: skip


@cache
def adaptive() -> Flight:
    return flight(ADAPTIVE, Sweep(), 7.0, w0=W0)


def constants() -> np.ndarray:
    """Return Theta: the inverse of H0, times h0, and its products with the momentum."""
    a = np.linalg.inv(H + np.diag(JW))[np.triu_indices(3)]
    return np.concatenate([ADAPTIVE.momentum_scale * a, *(a * each for each in P_R)])


def test_rate_is_linear_in_24_constants() -> None:
    of = adaptive()
    for row in (0, 2000, 4000):
        q, h = of.attitude[row], JW * of.wheel_speed[row]
        R = att.to_matrix(q)
        a = np.linalg.inv(H + np.diag(JW))
        np.testing.assert_allclose(a @ (R.T @ P_R - h), of.rate[row], atol=1e-12)
        # As the law has it, by a step whose estimates are the constants.
        state = ADAPTIVE.reset(*seen(of, row))._replace(Theta=constants()[None])
        _, _, signals = ADAPTIVE.step(state, 0.0, *seen(of, row))
        np.testing.assert_allclose(signals.estimated_rate[0], of.rate[row], atol=1e-12)


def seen(of: Flight, row: int) -> tuple[Measurement, Reference]:
    measured = Measurement(
        attitude=of.attitude[None, row],
        rate=np.full((1, 3), np.nan),
        wheel_speed=of.wheel_speed[None, row],
    )
    return measured, Reference(*(part[row] for part in of.reference))


def test_lyapunov_function_of_the_observer_decreases_as_derived() -> None:
    """V' = -l1 |eps_v|^2, V = 2 (1 - eps_0) + |Theta_o - Theta|^2 / (2 l2)."""
    of = adaptive()
    eps = att.multiply(att.conjugate(of.states["attitude"]), of.attitude)
    error = of.states["Theta"] - constants()
    V = 2.0 * (1.0 - np.abs(eps[:, 0])) + (error**2).sum(1) / (2.0 * ADAPTIVE.rate_injection)
    lost = np.cumsum(ADAPTIVE.attitude_injection * (eps[:, 1:] ** 2).sum(1)) * 1e-3
    assert np.diff(V).max() < 2e-8  # sampling, of the first step
    assert V[0] - V[-1] > 5e-6
    # The period is 0.06 of 1 / l1: of first order, 11 %.
    np.testing.assert_allclose(V[0] - V[1:], lost[:-1], atol=0.12 * (V[0] - V[-1]))


def test_adaptive_law_tracks_as_with_a_gyro() -> None:
    of, with_gyro = adaptive(), flight(Passivity(control_period=1e-3), Sweep(), 7.0, w0=W0)
    assert of.distance.max() == pytest.approx(with_gyro.distance.max(), rel=0.03)
    error = np.linalg.norm(of.signals["estimated_rate"] - of.rate, axis=1)
    assert error[0] > 0.24  # from rest
    assert error[of.time > 1.0].max() < 8e-3


def test_contraction_law_converges_with_its_observer() -> None:
    of = flight(CONTRACTION, Sweep(), 5.0, w0=W0)
    error = np.linalg.norm(of.signals["estimated_rate"] - of.rate, axis=1)
    assert error[of.time > 1.0].max() < 3e-4  # 2e-4, of the torque held for 1 ms
    assert of.distance[-1] < 2e-4


@pytest.mark.parametrize("law", [ADAPTIVE, CONTRACTION], ids=["adaptive", "contraction"])
def test_rate_is_not_read(law: object) -> None:
    one, blind = (
        flight(law, Sweep(), 0.05, w0=W0, rate_noise=noise)
        for noise in (None, np.full((51, 3), np.nan))
    )
    np.testing.assert_array_equal(one.torque, blind.torque)
    assert peak(one.torque) > 0.0
