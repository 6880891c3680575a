"""The arm's plane equations against particles and MuJoCo's, the wheels' closed form integrated."""

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mjspace import attitude
from mjspace.contract import Array
from mjspace.validation import stand
from mjspace.validation.benchmark import Conditions
from mjspace.validation.benchmarks import floating_arm
from mjspace.validation.benchmarks.floating_arm import (
    FORE,
    INERTIA,
    MASS,
    SHOULDER,
    START,
    TURN,
    UPPER,
    WHEEL,
    WHOLE,
)

ARM, WHEELS = floating_arm.BENCHMARKS


def angles(u: Array, base: Array) -> Array:
    """Absolute angles (n, 3) of base, upper arm and forearm."""
    shoulder, elbow = 0.8 + 0.7 * np.cos(u), 0.5 + 0.9 * np.sin(u)
    return base[:, None] + np.stack([0.0 * u, shoulder, shoulder + elbow], axis=-1)


def centres(phi: Array) -> Array:
    """Where the three bodies are in the plane, from the base's centre, complex, (n, 3)."""
    base, upper, fore = np.exp(1j * phi).T
    joint = SHOULDER * base
    return np.stack(
        [0.0 * base, joint + 0.5 * UPPER * upper, joint + UPPER * upper + 0.5 * FORE * fore], -1
    )


def test_loop_turns_the_base_by_the_reference() -> None:
    turned = floating_arm.base_angle(np.linspace(0.0, 2.0 * np.pi, 41))
    # The reference's digits; its own two routes agree to 1e-17.
    assert turned[-1] == pytest.approx(ARM.bounds[0].target, abs=1e-12)
    np.testing.assert_allclose(angles(np.zeros(1), np.zeros(1))[0, 1:], np.cumsum(START))


def test_base_angle_leaves_no_momentum() -> None:
    step = 1e-3
    u = np.arange(0.0, 2.0 * np.pi, step)
    phi = angles(u, floating_arm.base_angle(u))
    place = centres(phi)
    place -= (place @ MASS / MASS.sum())[:, None]
    velocity, rate = (np.gradient(x, step, axis=0)[1:-1] for x in (place, phi))
    orbital = (MASS * np.imag(np.conj(place[1:-1]) * velocity)).sum(axis=1)
    # Central differences: step^2 / 6 of the third derivatives, over parts of several kg m^2.
    np.testing.assert_allclose(orbital + rate @ INERTIA, 0.0, atol=3e-6)


def test_joint_torques_give_mujoco_the_accelerations_asked_for() -> None:
    model = stand.build(Conditions(0.01), "floating_arm")
    data = mujoco.MjData(model)
    random = np.random.default_rng(1)
    for _ in range(20):
        w, q1, q2, d1, d2, a1, a2 = random.normal(size=7)
        data.qpos[7:9], data.qvel[5:8] = (q1, q2), (w, d1, d2)
        data.qfrc_applied[6:] = floating_arm.joint_torques(q1, q2, w, d1, d2, a1, a2)
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.qacc[6:], [a1, a2], rtol=0.0, atol=1e-12)  # rounding


def test_wheels_end_where_the_reference_says() -> None:
    end = floating_arm.wheel_attitude(np.array([4.0]))[0]
    # All digits of the reference.
    np.testing.assert_allclose(
        end, [0.9998618936, -0.0013764575, 0.0016534388, 0.0164792368], rtol=0.0, atol=5e-11
    )
    assert np.degrees(WHEELS.bounds[0].target) == pytest.approx(1.904493692, abs=5e-10)


def test_wheels_closed_form_is_what_no_momentum_leaves() -> None:
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for turn in range(4):
        rate = np.zeros(3)
        rate[turn % 2] = -WHEEL * (TURN if turn < 2 else -TURN) / WHOLE[turn % 2]

        def slope(_: float, q: Array, rate: Array = rate) -> Array:
            return 0.5 * attitude.multiply(q, np.append(0.0, rate))

        q = solve_ivp(slope, (0.0, 1.0), q, "DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        exact = floating_arm.wheel_attitude(np.array([turn + 1.0]))[0]
        assert attitude.rotation_angle(exact, q) < 1e-13


def test_two_wheels_have_the_moments_of_the_page() -> None:
    model = stand.build(Conditions(0.01), "two_wheels")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    np.testing.assert_allclose(np.diag(full)[3:5], WHOLE, rtol=1e-15)
    np.testing.assert_allclose(
        full[6:, 3:], np.hstack([WHEEL * np.eye(2, 3), WHEEL * np.eye(2)]), atol=1e-15
    )
