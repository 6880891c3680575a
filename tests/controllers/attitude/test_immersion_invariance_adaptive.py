"""Adaptive immersion and invariance: the identities that prove it, in sampled flights."""

from functools import cache

import numpy as np
import pytest
from mjspace.controllers.attitude.immersion_invariance_adaptive import Adaptive
from mjspace.controllers.references.references import MultiAxis
from oracle import Flight
from paper_satellite import AXES, JW, THETA, H, flight, peak

SIX = THETA[:6]


@cache
def flown(period: float = 1e-3) -> Flight:
    gains = {"target_gain": 5.0, "manifold_gain": 5.0, "adaptation_gain": 1000.0}
    law = Adaptive(AXES, JW, control_period=period, **gains)
    return flight(law, MultiAxis(), 5.0, period=period, w0=np.array([0.2, -0.142, 0.0]))


def test_what_is_left_of_z_is_the_filtered_regressor_times_the_error() -> None:
    """H (z - nu) = Y_f (theta_hat - theta), exact in continuous time."""
    broken = []
    for period in (2e-3, 1e-3):
        of = flown(period)
        error = of.states["theta_hat"] - SIX
        product = np.einsum("nij,nj->ni", of.states["Y_f"], error)
        broken.append(peak((of.signals["z"] - of.states["nu"]) @ H.T - product))
    assert broken[1] < 3.5e-3  # 3.0e-3, of a product of 3.8
    assert broken[0] / broken[1] == pytest.approx(2.0, abs=0.1)


def test_error_of_the_estimate_never_grows() -> None:
    of = flown()
    error = np.linalg.norm(of.states["theta_hat"] - SIX, axis=1)
    assert np.diff(error).max() < 1e-6 * error[0]
    assert error[-1] < 0.55 * error[0]  # 15 of 28.7


class Known(Adaptive):
    """Starts from the truth."""

    def reset(self, measurement, reference):  # type: ignore[no-untyped-def]
        return super().reset(measurement, reference)._replace(theta_hat=SIX[None])


def test_with_the_inertia_known_z_decays_at_gamma() -> None:
    law = Known(AXES, JW, control_period=1e-3, target_gain=5.0)
    of = flight(law, MultiAxis(), 2.0, w0=np.array([0.2, -0.142, 0.0]))
    exact = of.signals["z"][0] * np.exp(-5.0 * of.time)[:, None]
    assert peak(of.signals["z"] - exact) < 5e-4  # the held torque
    np.testing.assert_allclose(of.states["theta_hat"][-1], SIX, atol=2e-2)
