"""The multiplicative extended Kalman filter: its contract, its propagation, and its updates.

That its errors are as large as its covariance says is tested in flight: test_consistency.py.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mjspace.controllers.determination.error_state import attitude_error, corrected
from mjspace.controllers.determination.mekf import ATTITUDE, BIAS, MEKF, UNKNOWN, Estimate, State

from mjspace import attitude as att
from mjspace.contract import Array, Measurement

STAR = MEKF(
    control_period=0.1, gyro_noise=1e-4, gyro_bias=1e-3, gyro_walk=1e-5, attitude_noise=1e-3
)
VECTORS = replace(STAR, attitude_noise=0.0, sun_noise=2e-3, field_noise=1e-7)
ALL = replace(STAR, sun_noise=2e-3, field_noise=1e-7)


def measurements(count: int, steps: int, seed: int = 0, **changes: Any) -> list[Measurement]:
    """Return what vehicles that turn steadily measure without errors, each another."""
    draw = np.random.default_rng(seed)
    q, rate = att.normalize(draw.normal(size=(count, 4))), 0.2 * draw.normal(size=(count, 3))
    sun, field = att.normalize(draw.normal(size=(2, count, 3)))
    found = []
    for k in range(steps):
        now = att.multiply(q, att.from_rotation_vector(0.1 * k * rate))
        body = [att.rotate(att.conjugate(now), each) for each in (sun, 4e-5 * field)]
        found.append(
            Measurement(
                **{
                    "attitude": now,
                    "rate": rate,
                    "sun_direction": body[0],
                    "magnetic_field": body[1],
                    "sun_reference": sun,
                    "field_reference": 4e-5 * field,
                    **changes,
                }
            )
        )
    return found


def estimated(law: MEKF, seen: list[Measurement]) -> tuple[list[State], list[Estimate]]:
    states, estimates = [law.reset(seen[0])], []
    for k, each in enumerate(seen):
        state, estimate = law.step(states[-1], 0.1 * k, each)
        states.append(state)
        estimates.append(estimate)
    return states, estimates


@pytest.mark.parametrize("law", [STAR, VECTORS, ALL])
def test_it_is_pure_and_the_same_alone_and_in_a_batch(law: MEKF) -> None:
    seen = measurements(4, 3)
    for each in seen:
        for array in vars(each).values():
            array.setflags(write=False)
    together = estimated(law, seen)
    again = estimated(law, seen)
    alone = estimated(law, [each._map(lambda array: array[2]) for each in seen])
    for a, b, c in zip(*(x + y for x, y in (together, again, alone)), strict=True):
        for one, same, single in zip(a, b, c, strict=True):
            assert np.array_equal(one, same)
            assert np.array_equal(one[2], single)


@pytest.mark.parametrize("law", [STAR, VECTORS, ALL])
def test_the_sign_of_a_measured_quaternion_does_not_matter(law: MEKF) -> None:
    seen = measurements(5, 4)
    _, one = estimated(law, seen)
    _, other = estimated(law, [each._replace(attitude=-each.attitude) for each in seen])
    for a, b in zip(one, other, strict=True):
        assert np.abs(att.rotation_angle(a.attitude, b.attitude)).max() < 1e-14
        assert np.allclose(a.covariance, b.covariance, rtol=1e-12, atol=1e-20)


@pytest.mark.parametrize("law", [STAR, VECTORS, ALL])
def test_without_errors_it_stays_at_the_truth(law: MEKF) -> None:
    seen = measurements(5, 50)
    _, found = estimated(law, seen)
    for estimate, each in zip(found, seen, strict=True):
        assert att.rotation_angle(estimate.attitude, each.attitude).max() < 1e-13
        assert np.abs(estimate.gyro_bias).max() < 1e-12
        assert (estimate.attitude_bound > 0.0).all()
    assert np.array_equal(np.diagonal(found[-1].covariance, axis1=-2, axis2=-1)[:, ATTITUDE] ** 0.5
                          * 3.0, found[-1].attitude_bound)  # fmt: skip


@pytest.mark.parametrize("law", [STAR, VECTORS])
def test_a_constant_bias_of_the_gyro_is_found(law: MEKF) -> None:
    bias = np.array([2e-3, -1e-3, 1.5e-3])
    seen = [each._replace(rate=each.rate + bias) for each in measurements(3, 1200)]
    _, found = estimated(replace(law, gyro_walk=0.0), seen)
    last, P = found[-1], found[-1].covariance[..., BIAS, BIAS]
    assert (np.abs(last.gyro_bias - bias) < 0.02 * np.abs(bias).max()).all()
    assert np.allclose(last.rate, seen[-1].rate - last.gyro_bias, rtol=0.0, atol=0.0)
    assert (np.sqrt(np.diagonal(P, axis1=-2, axis2=-1)) < 1e-4).all()


def test_the_covariance_grows_by_the_closed_form_between_samples() -> None:
    """Angle random walk, bias drift and random walk: Farrenkopf's terms, at rest."""
    held = measurements(1, 1)[0]._map(np.copy)
    seen = [held._replace(rate=0.0 * held.rate)] * 101  # no new sample of the star tracker
    _, found = estimated(STAR, seen)
    t, P = 100 * 0.1, found[-1].covariance[0]
    angle = 1e-6 + t * 0.1 * 1e-8 + t**2 * 1e-6 + t**3 / 3.0 * 1e-10
    assert np.allclose(P[ATTITUDE, ATTITUDE], angle * np.eye(3), rtol=1e-12, atol=1e-20)
    assert np.allclose(
        P[ATTITUDE, BIAS], -(t * 1e-6 + t**2 / 2.0 * 1e-10) * np.eye(3), rtol=1e-12, atol=1e-20
    )
    assert np.allclose(P[BIAS, BIAS], (1e-6 + t * 1e-10) * np.eye(3), rtol=1e-12, atol=1e-20)
    assert all(np.array_equal(each.innovation, [[0.0]]) for each in found)


def test_the_errors_propagate_as_the_attitude_does() -> None:
    """The transition matrix against finite differences of two attitudes under one gyro."""
    law = replace(STAR, gyro_noise=0.0, gyro_walk=0.0, gyro_bias=0.0)
    draw = np.random.default_rng(6)
    q, w = att.normalize(draw.normal(size=4)), np.array([0.5, -0.8, 0.3])
    columns = []
    for axis in range(6):
        small = 1e-6 * np.eye(6)[axis]
        turned = att.multiply(q, att.from_rotation_vector(small[ATTITUDE]))
        # An error of the bias is that of the estimated rate, with the other sign.
        after = [
            att.multiply(start, att.from_rotation_vector(0.1 * rate))
            for start, rate in ((q, w), (turned, w - small[BIAS]))
        ]
        columns.append([*attitude_error(after[0], after[1]), *small[BIAS]])
    phi = np.array(columns).T / 1e-6
    P = np.cov(draw.normal(size=(6, 20)))
    state = State(q, np.zeros(3), P, w, q, np.ones(1))
    _, found = law._propagated(state, w)
    # The bias's part is of second order: h^3 |w|^2 / 24 of 4e-5.
    assert np.allclose(found, phi @ P @ phi.T, rtol=0.0, atol=2e-4)
    assert not np.allclose(found, P, rtol=0.0, atol=2e-3)


@pytest.mark.parametrize("quantity", ["attitude", "sun_direction", "magnetic_field"])
def test_an_update_is_the_least_squares_of_prior_and_sample(quantity: str) -> None:
    """Against the linear solution by matrices, for errors so small that it is linear."""
    noise = {"attitude": 1e-3, "sun_direction": 2e-3, "magnetic_field": 1e-7}
    names = {"attitude": "attitude_noise", "sun_direction": "sun_noise"}
    off = dict.fromkeys(("attitude_noise", "sun_noise", "field_noise"), 0.0)
    name = names.get(quantity, "field_noise")
    law = replace(STAR, **(off | {name: noise[quantity]}))
    (true,) = measurements(1, 1, seed=3)
    true = true._map(lambda array: array[0])
    draw = np.random.default_rng(7)
    P = 1e-6 * np.cov(draw.normal(size=(6, 20)))
    error = 1e-6 * draw.normal(size=3)
    q = att.multiply(true.attitude, att.from_rotation_vector(-error))
    sample = getattr(true, quantity)
    width = len(sample)
    b = np.zeros(3)
    found, bias, after, square = law._updated(q, b, P, np.zeros(width), true)
    H = np.zeros((3, 6))
    if quantity == "attitude":
        H[:, :3], innovation = np.eye(3), attitude_error(q, sample)
    else:
        known = {"sun_direction": true.sun_reference}.get(quantity, true.field_reference)
        expected = att.rotate(att.conjugate(q), known)
        innovation = sample - expected
        H[:, :3] = [[0.0, -expected[2], expected[1]], [expected[2], 0.0, -expected[0]],
                    [-expected[1], expected[0], 0.0]]  # fmt: skip
    S = H @ P @ H.T + noise[quantity] ** 2 * np.eye(3)
    K = P @ H.T @ np.linalg.inv(S)
    x = K @ innovation
    assert np.allclose(attitude_error(q, found), x[:3], rtol=1e-6, atol=1e-15)
    assert np.allclose(bias, x[3:], rtol=1e-6, atol=1e-18)
    joseph = (np.eye(6) - K @ H) @ P @ (np.eye(6) - K @ H).T + noise[quantity] ** 2 * K @ K.T
    assert np.allclose(after, joseph, rtol=1e-9, atol=1e-24)
    assert np.array_equal(after, after.T)
    assert square == pytest.approx(innovation @ np.linalg.solve(S, innovation), rel=1e-9)
    assert not np.allclose(joseph, P, rtol=1e-4, atol=0.0)


def test_no_sample_is_used_twice_and_none_that_is_not_valid() -> None:
    seen = measurements(1, 2, seed=4)
    law = ALL
    state = law.reset(seen[0])
    _, first = law.step(state, 0.0, seen[0])  # which the reset has used
    assert np.array_equal(first.innovation, [[0.0, 0.0, 0.0]])
    assert np.array_equal(first.covariance, state.covariance)
    state, _ = law.step(state, 0.0, seen[0])
    _, both = law.step(state, 0.1, seen[1])
    # Without errors a Sun that is not where it was is what was expected: 0, and P shrinks.
    dark = seen[1]._replace(sun_direction=np.zeros((1, 3)))
    _, without = law.step(state, 0.1, dark)
    invalid = seen[1]._replace(sun_direction_valid=np.zeros((1, 1)))
    _, flagged = law.step(state, 0.1, invalid)
    traces = [np.trace(each.covariance[0, :3, :3]) for each in (both, without, flagged)]
    assert traces[0] < 0.95 * traces[1]
    assert traces[1] == traces[2]
    off = seen[1]._replace(sun_direction=-seen[1].sun_direction)
    assert law.step(state, 0.1, off)[1].innovation[0, 1] > 1e3
    valid = off._replace(sun_direction_valid=np.zeros((1, 1)))
    assert law.step(state, 0.1, valid)[1].innovation[0, 1] == 0.0


def test_it_starts_with_what_the_first_samples_tell() -> None:
    (seen,) = measurements(6, 1, seed=8)
    start = VECTORS.reset(seen)
    assert att.rotation_angle(start.attitude, seen.attitude).max() < 1e-10
    sigma = np.array([2e-3, 1e-7 / 4e-5])
    body = np.stack([seen.sun_direction, att.normalize(seen.magnetic_field)], axis=-2)
    for k in range(6):
        information = sum(
            (np.eye(3) - np.outer(b, b)) / s**2 for b, s in zip(body[k], sigma, strict=True)
        )
        assert np.allclose(
            start.covariance[k, :3, :3], np.linalg.inv(information), rtol=1e-8, atol=1e-14
        )
    dark = VECTORS.reset(seen._replace(sun_direction=np.zeros((6, 3))))
    assert np.array_equal(dark.covariance[:, :3, :3], np.tile(UNKNOWN**2 * np.eye(3), (6, 1, 1)))
    assert np.isfinite(dark.attitude).all()


def test_the_covariance_stays_positive_definite() -> None:
    """After 1e4 steps with samples that are far better than what was known."""
    sharp = replace(STAR, attitude_noise=1e-9, gyro_noise=1e-3, gyro_bias=1.0, gyro_walk=1e-12)
    seen = measurements(2, 200)
    state = sharp.reset(seen[0])
    for k in range(10000):
        state, _ = sharp.step(state, 0.0, seen[k % 200])
        P = state.covariance
    assert np.array_equal(P, P.swapaxes(-1, -2))
    scale = np.sqrt(np.diagonal(P, axis1=-2, axis2=-1))
    assert np.linalg.eigvalsh(P / scale[:, :, None] / scale[:, None, :]).min() > 1e-12


def test_a_correction_without_a_fresh_sample_changes_nothing() -> None:
    draw = np.random.default_rng(9)
    x, P = draw.normal(size=6), np.cov(draw.normal(size=(6, 20)))
    H, innovation = draw.normal(size=(3, 6)), draw.normal(size=3)
    kept: tuple[Array, ...] = corrected(x, P, H, innovation, 0.1, np.array([False]))
    assert np.array_equal(kept[0], x)
    assert np.array_equal(kept[1], P)
    assert np.array_equal(kept[2], [0.0])
