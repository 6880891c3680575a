"""Sharing a torque among thrusters that only push, and making pulses of the shares."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mjspace.controllers.thrusters.allocation import effect, pattern, pulses, share, within
from scipy.optimize import nnls

# Two on each side of each axis of a box of 0.8 x 0.8 x 1 m.
POSITIONS = np.array([
    [0, 0.4, -0.5], [0, -0.4, 0.5], [0, -0.4, -0.5], [0, 0.4, 0.5],
    [-0.4, 0, 0.5], [0.4, 0, -0.5], [0.4, 0, 0.5], [-0.4, 0, -0.5],
    [0.4, -0.4, 0], [-0.4, 0.4, 0], [-0.4, -0.4, 0], [0.4, 0.4, 0],
])  # fmt: skip
X, Y, Z = np.eye(3)
DIRECTIONS = np.array([Z, -Z, Z, -Z, X, -X, -X, X, Y, -Y, Y, -Y])
EFFECTS = effect(POSITIONS, DIRECTIONS, np.full(12, 0.5))


def test_each_thruster_has_its_lever() -> None:
    np.testing.assert_allclose(EFFECTS[:, 4], [0, 0.25, 0, 0.5, 0, 0])
    np.testing.assert_allclose(EFFECTS[:, 10], [0, 0, -0.2, 0, 0.5, 0])


@given(seed=st.integers(0, 10**6), rows=st.integers(1, 6), columns=st.integers(1, 16))
@settings(max_examples=150, deadline=None)
def test_no_shares_come_nearer_than_these(seed: int, rows: int, columns: int) -> None:
    random = np.random.default_rng(seed)
    effects, wanted = random.normal(size=(rows, columns)), random.normal(size=rows)
    shares = share(wanted, effects)
    assert (shares >= 0.0).all()
    assert np.count_nonzero(shares) <= rows
    _, least = nnls(effects, wanted)
    assert np.linalg.norm(effects @ shares - wanted) <= least + 1e-9


def test_any_torque_is_made_without_a_push() -> None:
    random = np.random.default_rng(3)
    wanted = np.concatenate([random.normal(size=(50, 3)), np.zeros((50, 3))], axis=1)
    shares = share(wanted, EFFECTS)
    np.testing.assert_allclose(shares @ EFFECTS.T, wanted, atol=1e-12)
    for one, together in zip(wanted, shares, strict=True):
        np.testing.assert_array_equal(share(one, EFFECTS), together)


def test_what_is_too_much_keeps_its_direction() -> None:
    wanted = np.array([0.8, 1.0, -0.4, 0.0, 0.0, 0.0])
    shares, factor = within(share(wanted, EFFECTS))
    assert shares.max() == pytest.approx(1.0)
    np.testing.assert_allclose(EFFECTS @ shares, factor * wanted, atol=1e-12)
    assert factor == pytest.approx(0.5)
    assert within(np.array([0.3, 0.7]))[1] == 1.0


def test_pulses_carry_over_what_they_do_not_fire() -> None:
    period, least = 0.1, 0.02
    shares, carry, fired = np.array([0.07, 0.53, 0.0, 1.0, 0.97]), np.zeros(5), np.zeros(5)
    for _ in range(1000):
        on_time, carry = pulses(shares, carry, period, least)
        assert ((on_time == 0.0) | (on_time >= least)).all()
        assert (on_time <= period).all()
        fired += on_time
    # all but less than one least pulse has been fired
    assert (np.abs(1000 * period * shares - fired) <= least).all()
    np.testing.assert_allclose(1000 * period * shares - fired, carry, atol=1e-10)


def test_each_of_unlike_thrusters_has_its_own_least_pulse() -> None:
    due, least = np.array([0.2, 0.2, 0.4]), np.array([0.01, 0.03, 0.03])
    on_time, carry = pulses(due, np.zeros(3), 0.1, least)
    np.testing.assert_allclose(on_time, [0.02, 0.0, 0.04], atol=1e-15)
    np.testing.assert_allclose(carry, [0.0, 0.02, 0.0], atol=1e-15)


def test_a_pattern_is_a_pure_torque_at_full_thrust() -> None:
    shares = pattern(-Y, EFFECTS)
    np.testing.assert_allclose(shares, np.eye(12)[6] + np.eye(12)[7], atol=1e-12)
    np.testing.assert_allclose(EFFECTS @ shares, [0, -0.5, 0, 0, 0, 0], atol=1e-12)


def test_thrusters_that_cannot_turn_it_are_refused() -> None:
    with pytest.raises(ValueError, match="no pure torque about"):
        pattern(Z, EFFECTS[:, :8])
