"""The steering of the double gimbal against the momentum that it steers."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.cmg.steering import (
    carried,
    gimbal_load,
    momentum,
    steer,
    steer_as_printed,
    torque_matrix,
    within,
)
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from mjspace.contract import Array

JW = 0.016
SPEED = np.array([73.0])
UP = np.array([0.0, 0.0, 1.0])


def frame(angle: Array) -> Array:
    """Return the inner gimbal's axes s, gi, t as columns, bus axes: Rz(do) Ry(di)."""
    return Rotation.from_euler("ZY", angle).as_matrix()


def of_wheel(angle: Array, speed: Array) -> Array:
    return JW * speed[0] * frame(angle)[:, 0]


def readings(count: int) -> tuple[Array, Array, Array]:
    """Return torques [N m], gimbal angles [rad] and wheel speeds [rad/s], of either sign."""
    rng = np.random.default_rng(3)
    angle = rng.uniform(-np.pi, np.pi, (count, 2))
    speed = rng.uniform(30.0, 200.0, (count, 1)) * rng.choice([-1.0, 1.0], (count, 1))
    return rng.normal(size=(count, 3)), angle, speed


def test_the_torque_is_the_momentum_lost() -> None:
    """(2.55), with the axes of E3 and the sign of E18, by central differences."""
    _, angles, speeds = readings(50)
    h = 1e-5
    for angle, speed in zip(angles, speeds, strict=True):
        chi = torque_matrix(angle, speed, JW)
        for eta in np.eye(3):
            shift = h * eta
            after = of_wheel(angle + shift[:2], speed + shift[2])
            before = of_wheel(angle - shift[:2], speed - shift[2])
            # h^2/6 of the third derivative, Jw W, and rounding of 1e-16 Jw W / h.
            np.testing.assert_allclose(chi @ eta, (after - before) / (2.0 * h), atol=1e-9)


def test_the_steering_inverts_it() -> None:
    torque, angle, speed = readings(200)
    eta, authority = steer(torque, angle, speed, JW, 0.0)
    given = -np.einsum("nij,nj->ni", torque_matrix(angle, speed, JW), eta)
    np.testing.assert_allclose(given, torque, atol=1e-12)
    # The authority is the torque about gi for each rad/s, which only the outer gimbal can give.
    along = np.einsum("nij,ni->nj", torque_matrix(angle, speed, JW), frame(angle)[:, :, 1])
    np.testing.assert_allclose(authority[:, 0], np.linalg.norm(along, axis=-1), rtol=1e-12)
    damped, _ = steer(torque, angle, speed, JW)
    np.testing.assert_array_equal(damped[:, 1:], eta[:, 1:])


def test_the_damped_command_is_bounded_and_keeps_its_sign() -> None:
    inner = np.concatenate([np.radians(np.linspace(-180.0, 180.0, 3601)), [-np.pi / 2, np.pi / 2]])
    angle = np.stack([np.zeros_like(inner), inner], axis=-1)
    push = np.array([0.0, -1.0, 0.0])  # N m along -gi: all of it the outer gimbal's
    outer = steer(push, angle, SPEED, JW)[0][:, 0] * JW * SPEED[0]
    exact = steer(push, angle, SPEED, JW, 0.0)[0][:, 0] * JW * SPEED[0]
    assert 49.0 < np.abs(outer).max() <= 50.0  # 1 / (2 damping), at acos(0.01) = 89.4 deg
    assert np.abs(outer[-2:]).max() < 1e-11  # in the singularity it asks for nothing
    regular = np.abs(np.cos(inner)) > 1e-9
    assert (outer * exact)[regular].min() > 0.0
    near = np.radians([[0.0, 89.0], [0.0, 80.0]])
    lost = 1.0 - steer(push, near, SPEED, JW)[0][:, 0] / steer(push, near, SPEED, JW, 0.0)[0][:, 0]
    np.testing.assert_allclose(lost, [0.247, 0.0033], rtol=0.01)


def printed_share(inner: float, zeta: float = 10.0) -> float:
    """Return the printed do' over the right one, at an inner angle in degrees."""
    angle, push = np.array([0.0, np.radians(inner)]), np.array([0.0, -1.0, 0.0])
    printed, _ = steer_as_printed(push, angle, SPEED, JW, 0.01, zeta)
    return float(printed[0] / steer(push, angle, SPEED, JW, 0.0)[0][0])


def test_the_printed_gamma_cannot_fly() -> None:
    """E17: cos(di) / (cos(di) + gamma) should be near 1."""
    cosine = np.cos(np.radians(5.0))
    assert cosine / printed_share(5.0) - cosine == pytest.approx(17.8, abs=0.05)
    assert printed_share(20.0) == pytest.approx(0.04, abs=2e-3)
    for low, high, zero in ((-1.0, -0.1, -0.26), (-60.0, -20.0, -47.8)):
        found = brentq(lambda inner: 1.0 / printed_share(inner), low, high)
        assert found == pytest.approx(zero, abs=0.05)
    assert printed_share(-47.0) < 0.0
    assert printed_share(-1.0) < 0.0
    for low, high, zero in ((-89.9, -85.0, -89.43), (90.1, 95.0, 90.57)):
        found = brentq(lambda inner: 1.0 / printed_share(inner, -10.0), low, high)
        assert found == pytest.approx(zero, abs=5e-3)
    assert printed_share(45.0, -10.0) == pytest.approx(1.0, abs=1e-4)


def test_the_printed_form_differs_in_the_outer_rate_alone() -> None:
    torque, angle, speed = readings(20)
    printed, authority = steer_as_printed(torque, angle, speed, JW)
    ours, same = steer(torque, angle, speed, JW)
    np.testing.assert_allclose(printed[:, 1:], ours[:, 1:], rtol=1e-15)  # 1.7e-16
    np.testing.assert_array_equal(authority, same)


def test_the_gimbals_bear_what_turns_the_wheel() -> None:
    """By central differences of the wheel's momentum in inertial axes, the bus turning too."""
    rng = np.random.default_rng(9)
    _, angles, speeds = readings(30)
    h = 1e-5
    for angle, speed in zip(angles, speeds, strict=True):
        rate, eta = rng.normal(size=3), rng.normal(size=3)

        def inertial(
            t: float,
            rate: Array = rate,
            angle: Array = angle,
            speed: Array = speed,
            eta: Array = eta,
        ) -> Array:
            now = of_wheel(angle + t * eta[:2], speed + t * eta[2])
            return Rotation.from_rotvec(t * rate).apply(now)

        torque = (inertial(h) - inertial(-h)) / (2.0 * h)
        expected = [torque @ UP, torque @ frame(angle)[:, 1]]
        found = gimbal_load(rate, angle, eta, speed, JW)
        # h^2/6 of the third derivative, below 1e3 N m/s^2, and rounding.
        np.testing.assert_allclose(found, expected, atol=2e-8)


def test_the_gimbals_bear_the_whole_output() -> None:
    load = gimbal_load(np.zeros(3), np.zeros(2), np.array([1.0, 0.5, 0.0]), np.array([150.0]), JW)
    np.testing.assert_allclose(load, [-1.20, 2.40], atol=1e-12)  # E20
    torque, angle, speed = readings(50)
    eta, _ = steer(torque, angle, speed, JW, 0.0)
    load = gimbal_load(np.zeros((50, 3)), angle, eta, speed, JW)
    # No torque amplification: the bus gets about go what the outer motor gives, reversed.
    np.testing.assert_allclose(load[:, 0], -torque[:, 2], atol=1e-12)


@pytest.mark.parametrize(
    "law",
    [
        lambda torque, angle, speed: steer(torque, angle, speed, JW),
        lambda torque, angle, speed: steer_as_printed(torque, angle, speed, JW),
        lambda torque, angle, speed: (gimbal_load(torque, angle, torque, speed, JW),),
        lambda _, angle, speed: (torque_matrix(angle, speed, JW),),
    ],
    ids=["damped", "printed", "load", "matrix"],
)
def test_alone_and_in_a_batch_are_the_same_bits(law: Any) -> None:
    given = readings(64)
    together = law(*given)
    for i in range(64):
        alone = law(*(part[i] for part in given))
        assert all(np.array_equal(one, many[i]) for one, many in zip(alone, together, strict=True))


def test_a_bus_and_its_wheel_have_the_sum_of_their_momenta() -> None:
    rate, angle, speed = readings(20)
    bus = np.array([[10.5, 0.22, 0.47], [0.22, 12.5, 0.36], [0.47, 0.36, 13.6]])
    for w, at, W, h in zip(rate, angle, speed, momentum(bus, rate, angle, speed, JW), strict=True):
        np.testing.assert_allclose(h, bus @ w + of_wheel(at, W), rtol=1e-13, atol=1e-13)


def test_what_carries_the_wheel_turns_with_the_bus_and_the_outer_gimbal() -> None:
    """Against the inner gimbal's attitude in inertial axes, by central differences."""
    rate, angle, _ = readings(50)
    turn = 3.0 * readings(51)[1][1:]
    h = 1e-5
    for w, at, by, seen in zip(rate, angle, turn, carried(rate, angle, turn), strict=True):
        after = Rotation.from_rotvec(h * w).as_matrix() @ frame(at + h * by)
        before = Rotation.from_rotvec(-h * w).as_matrix() @ frame(at - h * by)
        skew = frame(at).T @ (after - before) / (2.0 * h)  # S of the rate, in axes s, gi, t
        # h^2/6 of the third derivative, the cube of rates up to 13 rad/s
        assert seen == pytest.approx([0.0, 0.0, skew[2, 1]], abs=1e-7)


def test_gimbals_are_slowed_down_together_and_the_wheel_alone() -> None:
    limits = np.array([2.0, 2.0, 40.0])
    eta = np.array([[1.0, -1.5, 30.0], [4.0, -3.0, 30.0], [1.0, -8.0, -60.0]])
    wanted = [[1.0, -1.5, 30.0], [2.0, -1.5, 30.0], [0.25, -2.0, -40.0]]
    np.testing.assert_allclose(within(eta, limits), wanted, rtol=1e-15)
    # limited gimbals take the torque across the wheel's axis down, without turning it
    _, angle, speed = readings(40)
    fast = 10.0 * readings(41)[0][1:] * [1.0, 1.0, 0.0]
    chi = torque_matrix(angle, speed, JW)
    full, less = (np.einsum("nij,nj->ni", chi, e) for e in (fast, within(fast, limits)))
    share = np.linalg.norm(less, axis=1) / np.linalg.norm(full, axis=1)
    assert share.min() < 0.2
    np.testing.assert_allclose(less, share[:, None] * full, atol=1e-12)


def test_a_wheel_that_nearly_stands_steers_nothing() -> None:
    """Damped by h0 = 0.01 N m s: half at h0, nothing at rest, and never more than 1 / (2 h0)."""
    speed = np.array([[0.0], [0.01 / JW], [-0.01 / JW], [73.0]])
    push, still = np.array([0.0, 0.0, 1.0]), np.zeros(2)
    eta, _ = steer(push, still, speed, JW, 0.01, 0.01)
    np.testing.assert_allclose(eta[:3, 1], [0.0, 50.0, -50.0], rtol=1e-12)
    assert eta[3, 1] == pytest.approx(1.0 / (JW * 73.0), rel=1e-4)  # 7.3e-5 less
    np.testing.assert_array_equal(eta[:, 2], 0.0)


def test_a_wheel_at_rest_has_no_answer() -> None:
    with np.errstate(divide="ignore", invalid="ignore"):
        eta, authority = steer(np.ones(3), np.zeros(2), np.zeros(1), JW)
    assert not np.isfinite(eta[:2]).any()
    assert authority[0] == 0.0
