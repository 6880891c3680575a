"""The passivity-based and the Hamiltonian adaptive law: their Lyapunov function and limits."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from mjspace.controllers.attitude.adaptive_tracking import Hamiltonian, Passivity
from mjspace.controllers.attitude.contraction import Gradient
from mjspace.controllers.references.references import Regulation, Sweep
from oracle import Flight
from paper_satellite import THETA, H, flight, peak

from mjspace import attitude as att

W0 = np.array([0.2, -0.142, 0.0])


@cache
def sweep(law: Any) -> Flight:
    return flight(law(control_period=1e-3), Sweep(), 8.0, w0=W0)


@pytest.mark.parametrize("law", [Passivity, Hamiltonian])
def test_lyapunov_function_falls_by_what_the_damping_takes(law: Any) -> None:
    """V = s'Hs/2 + |theta error|^2/(2 ga), V' = -s' D s; for Passivity D = Kd."""
    of = sweep(law)
    s, error = of.signals["s"], of.states["theta_hat"] - THETA
    V = 0.5 * np.einsum("ni,ij,nj->n", s, H, s) + 0.5 * (error**2).sum(axis=1)
    assert np.diff(V).max() < 3e-5  # sampling
    assert V[0] - V[-1] > 10.0
    if law is Passivity:
        taken = np.cumsum(25.0 * (s**2).sum(axis=1)) * 1e-3
        np.testing.assert_allclose(V[0] - V[1:], taken[:-1], rtol=0.03, atol=1e-2)


def test_both_track_without_the_parameters() -> None:
    for law in (Passivity, Hamiltonian):
        of = sweep(law)
        assert of.distance[of.time > 7.9].max() < 7e-4  # 5.5e-4 and 6.2e-4
        assert np.linalg.norm(of.states["theta_hat"][-1] - THETA) > 0.9 * np.linalg.norm(THETA)


def test_passivity_is_the_gradient_law_of_002_to_second_order_of_the_error() -> None:
    """The desired rates of the two differ by the square of the attitude error."""
    one, other = sweep(Passivity), sweep(Gradient)
    assert peak(one.torque - other.torque) < 3e-2  # 2.3e-2, of 14.5 N m
    fast = [
        flight(law(control_period=1e-3), Regulation(), 1.0, w0=W0) for law in (Passivity, Gradient)
    ]
    assert peak(fast[0].torque - fast[1].torque) > 5e-2  # where the error is 6 deg


def test_only_the_quaternion_law_turns_through_a_pitch_of_90_deg() -> None:
    over = Sweep(axis=np.array([0.0, 1.0, 0.0]))
    of = flight(Passivity(control_period=1e-3), over, 6.0)
    assert of.distance.max() < 0.03
    pitch = att.to_euler_zyx(of.attitude)[:, 1]
    assert pitch.max() > np.radians(89.0)
    with np.errstate(all="ignore"):
        local = flight(Hamiltonian(control_period=1e-3), over, 4.1)
    assert not np.isfinite(local.torque).all() or peak(local.torque) > 1e6
