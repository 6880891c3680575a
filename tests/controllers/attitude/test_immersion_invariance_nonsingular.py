"""Immersion and invariance in MRP and quaternions, and computed torque, by their closed solutions.

What a torque held over a control period leaves is of first order in the period: figures are given
at 1 ms, and halve with it.
"""

from functools import cache
from typing import Any

import numpy as np
import pytest
from mjspace.controllers.attitude.computed_torque import ComputedTorque
from mjspace.controllers.attitude.immersion_invariance import ImmersionInvariance
from mjspace.controllers.attitude.immersion_invariance_nonsingular import Mrp, Quaternion
from mjspace.controllers.references.references import EulerSinusoids, Turning
from oracle import Flight
from paper_satellite import AXES, JW, TURNED, H, flight, peak

from mjspace import attitude as att

START = np.array([1.0, 1.0, -5.0])


@cache
def paper(law: Any, period: float = 1e-3) -> Flight:
    return flight(law(H, AXES, JW), EulerSinusoids(), 1.5, q0=TURNED, period=period)


@pytest.mark.parametrize(("law", "left"), [(Mrp, 5.7e-3), (Quaternion, 2.04e-2)])
def test_distance_from_the_manifold_decays_at_gamma(law: Any, left: float) -> None:
    errors = []
    for period in (1e-3, 0.5e-3):
        of = paper(law, period)
        exact = of.signals["z"][0] * np.exp(-5.0 * of.time)[:, None]
        errors.append(peak(of.signals["z"] - exact))
    assert errors[0] == pytest.approx(left, rel=0.02)  # of a z of 3.1 and 11.2
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.05)


def test_mrp_follow_the_closed_solution() -> None:
    of = paper(Mrp)
    slow, fast = np.exp(-5.0 * of.time)[:, None], np.exp(-10.0 * of.time)[:, None]
    z0, sigma0 = of.signals["z"][0], of.signals["sigma_e"][0]
    exact = (sigma0 - z0 / 5.0) * fast + z0 / 5.0 * slow
    assert peak(of.signals["sigma_e"] - exact) < 5.5e-4  # 4.8e-4


def test_on_the_manifold_the_quarter_angle_decays_at_the_target_gain() -> None:
    """Both laws: |sigma_e| = tan(angle / 4) falls by e^-Kt where z stays zero."""
    K, angle = 2.0, 3.0
    q0 = np.array([np.cos(0.5 * angle), 0.0, np.sin(0.5 * angle), 0.0])
    w0 = np.array([0.0, -2.0 * K * np.sin(0.5 * angle), 0.0])  # w_e + 2 K q_v = 0
    hold = Turning(rate=np.zeros(3))
    for law in (Mrp, Quaternion):
        of = flight(law(H, AXES, JW, target_gain=K), hold, 1.0, q0=q0, w0=w0)
        assert peak(of.signals["z"][0]) < 1e-12
        expected = np.tan(0.25 * angle) * np.exp(-K * of.time)
        sigma = np.linalg.norm(of.signals["sigma_e"], axis=1)
        # Holding the torque lets z grow to 7e-3 rad/s.
        np.testing.assert_allclose(sigma, expected, atol=1.5e-3)


@pytest.mark.parametrize("law", [Mrp, Quaternion])
def test_a_pitch_of_90_deg_is_no_place_of_its_own(law: Any) -> None:
    rate = np.array([0.0, 1.2, 0.0])
    of = flight(law(H, AXES, JW), Turning(rate=rate), 2.0, w0=rate)
    near = np.abs(of.time - np.pi / 2.4) < 0.1
    assert of.distance[near].max() < 1e-5  # the held torque
    assert peak(of.torque[near]) < 30.0  # the feedforward alone: 18 N m


def test_euler_angles_lose_it_there() -> None:
    law, over = ImmersionInvariance(H, AXES, JW), Turning(rate=np.array([0.0, 1.2, 0.0]))
    with np.errstate(all="ignore"):
        of = flight(law, over, 1.35, q0=att.from_euler_zyx(np.array([0.2, -0.3, 0.4])))
    assert of.distance[of.time < 1.29].max() < 0.6  # of the start
    assert of.distance[of.time > 1.29].max() > 1.0


def euler(law: Any, **gains: float) -> Flight:
    built = law(H, AXES, JW, unwrap_from=START, **gains)
    return flight(built, EulerSinusoids(), 3.0, q0=TURNED)


def test_computed_torque_is_immersion_and_invariance_with_other_names() -> None:
    """Kv = K + Gamma, Kp = K Gamma: the paper calls the laws similar; they are one."""
    one, other = euler(ImmersionInvariance), euler(ComputedTorque)
    assert peak(one.torque - other.torque) < 1e-10  # of 1950 N m; 2.2e-12
    assert peak(one.signals["x_e"] - other.signals["x_e"]) < 1e-13  # 1.7e-15


def test_computed_torque_critically_damped_is_another() -> None:
    one = euler(ImmersionInvariance)
    other = euler(ComputedTorque, rate_gain=2.0 * np.sqrt(50.0))
    assert peak(one.torque - other.torque) == pytest.approx(78.2, abs=0.2)
    assert peak(one.signals["x_e"] - other.signals["x_e"]) == pytest.approx(0.131, abs=1e-3)


def test_computed_torque_errors_obey_the_designed_equation() -> None:
    """A pair of gains that oscillates, 4 +- 6j: no K and Gamma give it."""
    of = euler(ComputedTorque, rate_gain=8.0, attitude_gain=52.0)
    x0, v0 = of.signals["x_e"][0], of.signals["dx_e"][0]
    t = of.time[:, None]
    exact = np.exp(-4.0 * t) * (x0 * np.cos(6.0 * t) + (v0 + 4.0 * x0) / 6.0 * np.sin(6.0 * t))
    assert peak(of.signals["x_e"] - exact) < 1.5e-2  # the held torque
