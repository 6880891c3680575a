"""A motion given by its rate: the attitude against an independent integration of the rate."""

import numpy as np
import pytest
from mjspace.controllers.references import rate_references
from mjspace.controllers.references.rate_references import Sinusoids
from scipy.integrate import solve_ivp

from mjspace import attitude as att
from mjspace.contract import Array

CHAPTER_5 = Sinusoids(
    np.array([0.05, 0.065, 0.035]),
    np.array([2.0 * np.pi / 60.0, 5.0 * np.pi / 54.0, 6.0 * np.pi / 40.0]),
    np.array([0.5 * np.pi, 0.0, 0.0]),
    np.array([0.1707, 0.1502, 0.0621]),
)
LIVELY = Sinusoids(np.array([2.0, -1.0, 1.5]), np.array([1.0, 3.0, 0.0]), np.array([1.0, 2.0, 3.0]))


def integrated(rate: object, start: Array, times: Array) -> Array:
    """Return the attitudes at ``times`` [s], of one sign, by DOP853."""

    def derivative(t: float, q: Array) -> Array:
        return 0.5 * att.multiply(q, np.concatenate([[0.0], rate(t)]))  # type: ignore[operator]

    span = (0.0, times[-1])
    return solve_ivp(
        derivative, span, att.from_mrp(start), "DOP853", times, rtol=3e-14, atol=1e-15
    ).y.T


def chapter_3(t: float) -> Array:
    """Return the rate of chapter 3, as printed."""
    sines = np.sin(np.pi * t * np.array([2.0 / 30.0, 5.0 / 27.0, 6.0 / 28.0]))
    return np.array([0.125, 0.075, 0.035]) * sines


def chapter_5(t: float) -> Array:
    angle = np.pi * t * np.array([2.0 / 60.0, 5.0 / 54.0, 6.0 / 40.0])
    return np.array([0.05, 0.065, 0.035]) * [np.cos(angle[0]), np.sin(angle[1]), np.sin(angle[2])]


@pytest.mark.parametrize(
    ("source", "rate"), [(Sinusoids(), chapter_3), (CHAPTER_5, chapter_5)], ids=["3", "5"]
)
def test_the_papers_motions(source: Sinusoids, rate: object) -> None:
    times = np.linspace(0.0, 60.0, 173)
    wanted = source.at(times)
    expected = integrated(rate, source.start_mrp, times)
    # 3e-14 measured, most of it the integration's.
    np.testing.assert_allclose(wanted.attitude, expected, rtol=0.0, atol=2e-13)
    rates = [rate(t) for t in times]  # type: ignore[operator]
    np.testing.assert_allclose(wanted.rate, rates, atol=1e-15)


def test_initial_errors_of_chapter_5() -> None:
    """E23: two values are printed for the second component, and neither is more likely."""
    identity = np.array([1.0, 0.0, 0.0, 0.0])
    for second, angle in ((0.1205, 49.19), (0.1502, 53.05)):
        start = Sinusoids(start_mrp=np.array([0.1707, second, 0.0621])).at(np.zeros(1)).attitude[0]
        assert np.degrees(att.rotation_angle(start, identity)) == pytest.approx(angle, abs=5e-3)


def test_the_attitude_converges_at_sixth_order(monkeypatch: pytest.MonkeyPatch) -> None:
    times = np.linspace(0.0, 3.0, 41)
    errors = []
    for turn in (0.05, 0.4, 0.8):
        monkeypatch.setattr(rate_references, "_TURN", turn)
        attitude = Sinusoids(LIVELY.amplitude, LIVELY.frequency, LIVELY.phase).at(times).attitude
        errors.append(attitude)
    far, near = (att.rotation_angle(errors[i], errors[0]).max() for i in (2, 1))
    assert np.log2(far / near) == pytest.approx(6.0, abs=0.5)


def test_parts_are_derivatives_before_zero_too() -> None:
    times, h = np.linspace(-5.0, 5.0, 1001), 1e-4
    before, now, after = (LIVELY.at(times + shift) for shift in (-h, 0.0, h))
    dq = (after.attitude - before.attitude) / (2.0 * h)
    spin = 2.0 * att.multiply(att.conjugate(now.attitude), dq)
    # h^2/6 of the third derivatives, below 30 rad/s^3; a jump from block to block would be 1/h.
    np.testing.assert_allclose(spin[:, 1:], now.rate, atol=5e-8)
    np.testing.assert_allclose(spin[:, 0], 0.0, atol=5e-8)
    bend = (after.rate - before.rate) / (2.0 * h)
    np.testing.assert_allclose(bend, now.acceleration, atol=5e-8)


def test_an_attitude_does_not_depend_on_what_was_asked_before() -> None:
    times = np.linspace(-1.0, 6.0, 57)
    together = LIVELY.at(times)
    fresh = Sinusoids(LIVELY.amplitude, LIVELY.frequency, LIVELY.phase)
    for i in np.random.default_rng(2).permutation(len(times)):
        alone = fresh.at(times[i : i + 1])
        assert all(np.array_equal(a[0], b[i]) for a, b in zip(alone, together, strict=True))


def test_turns_are_compiled_to_the_bits_of_the_algebra() -> None:
    turns = att.normalize(np.random.default_rng(3).normal(size=(100, 4)))
    found = rate_references._turned.ufunc(turns[0], turns)
    attitude = turns[0]
    for turn, row in zip(turns, found, strict=True):
        attitude = att.normalize(att.multiply(attitude, turn))
        np.testing.assert_array_equal(row, attitude)


def test_no_motion_is_a_held_attitude() -> None:
    still = Sinusoids(np.zeros(3), np.zeros(3), np.zeros(3)).at(np.array([0.0, 1.0, 1e6]))
    start = att.from_mrp(np.array([0.1707, 0.1205, 0.0621]))
    np.testing.assert_allclose(still.attitude, [start] * 3, atol=1e-15)
    assert not still.rate.any()
