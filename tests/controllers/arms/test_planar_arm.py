"""A planar arm's law: its torques are the derivatives of momentum and energy."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from mjspace.controllers.arms.planar_arm import PlanarArm

MASS, SHOULDER = 80.0, 0.4
LENGTH, MASSES = np.array([1.2, 0.9, 0.5]), np.array([6.0, 4.0, 1.5])
INERTIA = MASSES * LENGTH**2 / 12.0


def arm(**changes: Any) -> PlanarArm:
    gains: dict[str, Any] = {
        "control_period": 0.02,
        "link_length": LENGTH,
        "link_mass": MASSES,
        "link_inertia": INERTIA,
        "mass": MASS,
        "shoulder": SHOULDER,
        "start": np.zeros(3),
        "target": np.array([1.0, -0.7, 0.4]),
        "duration": 8.0,
        "joint_gain": 10.0,
        "joint_rate_gain": 5.0,
        "attitude_gain": 1.0,
        "rate_gain": 3.0,
    }
    return PlanarArm(**gains | changes)


def momentum_and_energy(angle: np.ndarray, rate: np.ndarray) -> tuple[float, float]:
    """Return them of bodies moved one by one, about the centre of mass of all, the bus at rest."""
    places, speeds, turning = [np.zeros(2)], [np.zeros(2)], [0.0]
    joint, joint_speed, phi, phi_rate = np.array([SHOULDER, 0.0]), np.zeros(2), 0.0, 0.0
    for length, q, dq in zip(LENGTH, angle, rate, strict=True):
        phi, phi_rate = phi + q, phi_rate + dq
        along = np.array([np.cos(phi), np.sin(phi)])
        across = phi_rate * np.array([-along[1], along[0]])
        places.append(joint + 0.5 * length * along)
        speeds.append(joint_speed + 0.5 * length * across)
        turning.append(phi_rate)
        joint, joint_speed = joint + length * along, joint_speed + length * across
    masses, inertia = np.array([MASS, *MASSES]), np.array([0.0, *INERTIA])
    r, v, w = np.array(places), np.array(speeds), np.array(turning)
    r, v = r - masses @ r / masses.sum(), v - masses @ v / masses.sum()
    momentum = masses @ (r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0]) + inertia @ w
    energy = 0.5 * masses @ np.sum(v * v, axis=-1) + 0.5 * inertia @ (w * w)
    return float(momentum), float(energy)


numbers = arrays(float, 3, elements=st.floats(-2.0, 2.0))


@given(numbers, numbers, numbers)
def test_torques_are_the_rates_of_momentum_and_energy(
    q: np.ndarray, dq: np.ndarray, ddq: np.ndarray
) -> None:
    law, h = arm(), 1e-5
    needed = law.torques(q, dq, ddq)
    (before, less), (after, more) = (
        momentum_and_energy(q + t * dq + 0.5 * t * t * ddq, dq + t * ddq) for t in (-h, h)
    )
    assert needed.sum() == pytest.approx((after - before) / (2.0 * h), abs=1e-6)
    power = (needed @ law._sums) @ dq
    assert power == pytest.approx((more - less) / (2.0 * h), abs=1e-6)


def test_the_path_has_the_derivatives_of_its_angles() -> None:
    law, h = arm(start_time=1.0), 1e-5
    for time in (0.5, 2.0, 5.0, 7.3, 9.5):
        (low, slow, _), (_, rate, acceleration), (high, fast, _) = (
            law.path(time + t) for t in (-h, 0.0, h)
        )
        assert np.allclose((high - low) / (2.0 * h), rate, atol=1e-9)
        assert np.allclose((fast - slow) / (2.0 * h), acceleration, atol=1e-9)
    assert np.allclose(law.path(0.0)[0], 0.0)
    assert np.allclose(law.path(9.0)[0], [1.0, -0.7, 0.4])


def test_unfit_gains_are_refused() -> None:
    with pytest.raises(ValueError, match="target"):
        arm(target=np.zeros(2))
    with pytest.raises(ValueError, match="feedforward"):
        arm(feedforward=1.5)
