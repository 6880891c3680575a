"""Single-gimbal CMGs: their steering against the momentum that it steers, and the law on it."""

from operator import itemgetter
from typing import Any

import numpy as np
import pytest
from mjspace.controllers.cmg.cmg_cluster import CmgCluster
from mjspace.controllers.cmg.cmg_steering import Cluster, momentum, steer

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Reference

SKEW = np.arccos(1.0 / np.sqrt(3.0))  # 54.74 deg
ROUND = 0.5 * np.pi * np.arange(4)
OUT = np.stack([np.cos(ROUND), np.sin(ROUND), 0.0 * ROUND], axis=-1)
GIMBALS = np.sin(SKEW) * OUT + np.cos(SKEW) * np.array([0.0, 0.0, 1.0])
SPINS = np.cross([0.0, 0.0, 1.0], OUT)
H0, SPEED = 2.0, np.full(4, 500.0)
PYRAMID = Cluster(GIMBALS, SPINS, np.full(4, 0.004))
EXACT = np.array([H0, 0.5, 0.0, 0.0, 0.0])
ROBUST = np.array([H0, 0.5, 0.01, 0.3, 0.0])
ELLIPTIC = np.radians([90.0, 0.0, -90.0, 0.0])
AT_REST = Reference(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))
START = np.zeros(1)


def torque_matrix(angle: Array) -> Array:
    """Return A (3, 4) by central differences of the momentum."""
    h = 1e-5
    columns = [
        momentum(PYRAMID, angle + h * e, SPEED) - momentum(PYRAMID, angle - h * e, SPEED)
        for e in np.eye(4)
    ]
    return np.stack(columns, axis=-1) / (2.0 * h * H0)


def readings(count: int, seed: int = 0) -> tuple[Array, Array]:
    """Return torques [N m] and gimbal angles [rad] that are away from singularities."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(-np.pi, np.pi, (4 * count, 4))
    _, measure, _ = steer(PYRAMID, np.zeros(3), angle, SPEED, START, EXACT)
    angle = angle[measure[:, 0] > 0.3][:count]
    assert len(angle) == count
    return rng.normal(size=(count, 3)), angle


def law(**gains: Any) -> CmgCluster:
    return CmgCluster(**{"inertia": np.diag([10.0, 12.0, 14.0]), **PYRAMID._asdict()} | gains)


def seen(count: int) -> Measurement:
    rng = np.random.default_rng(5)
    q = att.normalize(rng.normal(size=(count, 4)))
    angle, rate = rng.uniform(-3.0, 3.0, (count, 4)), 0.2 * rng.normal(size=(count, 3))
    return Measurement(
        attitude=q,
        rate=rate,
        wheel_speed=500.0 + rng.normal(size=(count, 4)),
        gimbal_angle=angle,
        gimbal_rate=0.0 * angle,
    )


def test_the_torque_is_the_momentum_lost() -> None:
    torque, angles = readings(50)
    for wanted, angle in zip(torque, angles, strict=True):
        rate, *_ = steer(PYRAMID, wanted, angle, SPEED, START, EXACT)
        given = -H0 * torque_matrix(angle) @ rate
        np.testing.assert_allclose(given, wanted, atol=1e-8)  # 1e-10/measure, by differences


def test_it_is_the_pseudo_inverse() -> None:
    torque, angles = readings(50)
    for wanted, angle in zip(torque, angles, strict=True):
        rate, measure, damping = steer(PYRAMID, wanted, angle, SPEED, START, EXACT)
        A = torque_matrix(angle)
        np.testing.assert_allclose(rate, -np.linalg.pinv(A) @ wanted / H0, atol=1e-8)
        assert measure[0] == pytest.approx(np.sqrt(np.linalg.det(A @ A.T)), abs=1e-9)
        assert damping[0] == 0.0


def test_the_robust_inverse_is_the_formulas() -> None:
    time = 0.7
    one, two, three = 0.3 * np.sin(0.5 * np.pi * (time + np.array([0.0, 1.0, 2.0])))
    E = np.array([[1.0, three, two], [three, 1.0, one], [two, one, 1.0]])
    for angle in ELLIPTIC + 0.05 * np.random.default_rng(2).normal(size=(20, 4)):
        A, wanted = torque_matrix(angle), np.array([0.5, -0.2, 0.3])
        rate, _, damping = steer(PYRAMID, wanted, angle, SPEED, np.array([time]), ROBUST)
        inverse = A.T @ np.linalg.inv(A @ A.T + damping[0] * E)
        np.testing.assert_allclose(rate, -inverse @ wanted / H0, atol=1e-8)  # by differences


def test_the_pyramid_at_zero_angles() -> None:
    _, measure, _ = steer(PYRAMID, np.zeros(3), np.zeros(4), SPEED, START, EXACT)
    # A A^T = diag(2 cos^2, 2 cos^2, 4 sin^2) of the skew: 32/27
    assert measure[0] == pytest.approx(np.sqrt(32.0 / 27.0), rel=1e-14)
    np.testing.assert_allclose(momentum(PYRAMID, np.zeros(4), SPEED), 0.0, atol=1e-15)


def test_its_elliptic_singularity() -> None:
    # 2 cos(skew) wheels along x and no torque on that axis, whatever the gimbals do
    h = momentum(PYRAMID, ELLIPTIC, SPEED)
    np.testing.assert_allclose(h, [-2.0 / np.sqrt(3.0) * H0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(torque_matrix(ELLIPTIC)[0], 0.0, atol=1e-9)
    _, measure, damping = steer(PYRAMID, np.ones(3), ELLIPTIC, SPEED, START, ROBUST)
    assert measure[0] < 1e-7  # the square root of rounding
    assert damping[0] == pytest.approx(0.01, rel=1e-6)


def test_the_pseudo_inverse_asks_for_rates_without_bound_and_the_robust_one_does_not() -> None:
    along = np.array([1.0, 0.0, 0.0])  # N m
    fastest = []
    for short in np.radians([10.0, 1.0, 0.1]):
        angle = ELLIPTIC - short * np.array([1.0, 0.0, -1.0, 0.0])
        exact, *_ = steer(PYRAMID, along, angle, SPEED, START, EXACT)
        robust, measure, damping = steer(PYRAMID, along, angle, SPEED, START, ROBUST)
        fastest.append(np.abs(exact).max())
        lacking = 1.0 - measure[0] / 0.5
        assert damping[0] == pytest.approx(0.01 * lacking**2, rel=1e-12)
        # sigma/(sigma^2 + lambda) is at most 1/(2 sqrt(lambda)): 2.5 rad/s; E adds its part
        assert np.linalg.norm(robust) < 1.5 * 0.5 / H0 / np.sqrt(damping[0])
    # the two gimbals make 2 cos(skew) sin(short) of h0
    np.testing.assert_allclose(fastest, 0.5 / H0 * np.sqrt(3.0) / np.sin(np.radians([10, 1, 0.1])))
    assert fastest[-1] > 100.0  # rad/s for 1 N m


def test_without_the_dither_it_is_locked() -> None:
    along = np.array([1.0, 0.0, 0.0])
    locked, *_ = steer(PYRAMID, along, ELLIPTIC, SPEED, START, np.array([H0, 0.5, 0.01, 0.0, 0.0]))
    assert np.abs(locked).max() < 1e-13
    free, *_ = steer(PYRAMID, along, ELLIPTIC, SPEED, np.array([0.5]), ROBUST)
    assert np.abs(free).max() > 0.05


def test_null_motion_makes_no_torque_and_a_larger_measure() -> None:
    _, angles = readings(50)
    gains = EXACT + np.array([0.0, 0.0, 0.0, 0.0, 1.0])
    for angle in angles:
        rate, measure, _ = steer(PYRAMID, np.zeros(3), angle, SPEED, START, gains)
        np.testing.assert_allclose(torque_matrix(angle) @ rate, 0.0, atol=1e-9)
        h = 1e-5
        ahead, behind = (
            steer(PYRAMID, np.zeros(3), angle + way * h * rate, SPEED, START, EXACT)[1][0] ** 2
            for way in (1.0, -1.0)
        )
        # m^2 grows by |d'|^2 / m^2 each second: d' is m^2 times the gradient's part without torque
        growth = (ahead - behind) / (2.0 * h)
        assert growth == pytest.approx(rate @ rate / measure[0] ** 2, rel=1e-5, abs=1e-9)


def test_the_space_station_of_the_lecture() -> None:
    """Vazquez 2016 (paper 004): 4760 N m s at 6600 rpm and 258 N m; classic.md, Task A."""
    h, torque, speed = 4760.0, 258.0, 6600.0 * 2.0 * np.pi / 60.0
    assert h / speed == pytest.approx(6.887, abs=5e-4)  # kg m^2
    one = Cluster(np.eye(3), np.eye(3)[[1, 2, 0]], np.full(3, h / speed))
    gains = np.array([h, 0.5, 0.0, 0.0, 0.0])
    wanted = np.array([0.0, 0.0, torque])  # the first gimbal's: x cross y
    rate, measure, _ = steer(one, wanted, np.zeros(3), np.full(3, speed), START, gains)
    assert measure[0] == pytest.approx(1.0)
    np.testing.assert_allclose(np.degrees(rate), [-3.106, 0.0, 0.0], atol=5e-4)  # deg/s


def test_alone_and_in_a_batch_the_same_bits_and_nothing_is_changed() -> None:
    flown, many = law(null_gain=0.3, gimbal_rate_limit=0.5), seen(16)
    for array in many._asdict().values():
        array.flags.writeable = False
    _, command, signals = flown.step(flown.reset(many, AT_REST), 0.7, many, AT_REST)
    assert command.gimbal_rate.shape == (16, 4)
    for i in range(16):
        one = many._map(itemgetter(i))
        _, alone, shown = flown.step(flown.reset(one, AT_REST), 0.7, one, AT_REST)
        np.testing.assert_array_equal(alone.gimbal_rate, command.gimbal_rate[i])
        for a, b in zip(shown, signals, strict=True):
            np.testing.assert_array_equal(a, b[i])


def test_both_quaternions_are_one_attitude() -> None:
    flown, many = law(), seen(8)
    turned = many._replace(attitude=-many.attitude)
    rates = [flown.step(flown.reset(m, AT_REST), 0.0, m, AT_REST)[1] for m in (many, turned)]
    np.testing.assert_array_equal(rates[0].gimbal_rate, rates[1].gimbal_rate)


def test_limited_rates_keep_the_direction_of_the_torque() -> None:
    many = seen(32)
    free, kept = (
        flown.step(flown.reset(many, AT_REST), 0.0, many, AT_REST)[1].gimbal_rate
        for flown in (law(), law(gimbal_rate_limit=9.0))
    )
    fastest = np.abs(free).max(axis=-1, keepdims=True)
    assert (fastest > 9.0).any()
    assert (fastest < 9.0).any()
    np.testing.assert_allclose(kept, free / np.maximum(fastest / 9.0, 1.0), rtol=1e-15)


def test_its_torque_carries_the_wheels_round() -> None:
    """A bus that turns as wanted needs w x (M w + h), of the wheels as well."""
    flown, angle = law(), np.radians([20.0, 40.0, -10.0, 30.0])
    rate = np.array([0.1, -0.05, 0.2])
    moving = AT_REST._replace(rate=rate)
    turning = Measurement(
        attitude=AT_REST.attitude,
        rate=rate,
        wheel_speed=SPEED,
        gimbal_angle=angle,
        gimbal_rate=0.0 * angle,
    )
    _, _, signals = flown.step(flown.reset(turning, moving), 0.0, turning, moving)
    whole = flown.inertia @ rate + momentum(PYRAMID, angle, SPEED)
    np.testing.assert_allclose(signals.torque, np.cross(rate, whole), atol=1e-14)


@pytest.mark.parametrize(
    ("gains", "message"),
    [
        ({"momentum": 0.0}, "momentum: got 0 .* greater than 0"),
        ({"damping": -1.0}, "damping: got -1.* 0 or more"),
        ({"dither": 0.5}, "dither: got 0.5.* less than 0.5"),
        ({"spin_axes": SPINS[:3]}, "spin_axes: 3 rows for 4 of gimbal_axes"),
    ],
)
def test_gains_that_cannot_work_are_refused(gains: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        law(**gains)
