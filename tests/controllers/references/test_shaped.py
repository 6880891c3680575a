"""Shaped slews: from rest to rest in the same time, and what they leave of a mode's vibration."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mjspace.controllers.references.shaped import BangBang

from mjspace import attitude as att

TURN = att.from_rotation_vector(np.array([0.5, -0.2, 0.3]))
ANGLE = float(np.linalg.norm([0.5, -0.2, 0.3]))
SHAPERS = ("none", "ZV", "ZVD")


def left_of_a_mode(slew: BangBang, frequency: float, damping: float) -> float:
    """Return the amplitude at the slew's end of x'' + 2 z w x' + w^2 x = -angular acceleration.

    By Duhamel's integral, over a fine grid.
    """
    step = 2e-4
    time = np.arange(0.0, slew.duration, step) + 0.5 * step
    acceleration = slew.at(time).acceleration @ (np.array([0.5, -0.2, 0.3]) / ANGLE)
    rate = 2.0 * np.pi * frequency
    pole = rate * complex(-damping, np.sqrt(1.0 - damping**2))
    return abs(np.sum(acceleration * np.exp(pole * (slew.duration - time))) * step) / rate


@settings(deadline=None, max_examples=30)
@given(
    st.sampled_from(SHAPERS),
    st.floats(0.3, 2.0),
    st.floats(0.0, 0.3),
    st.floats(4.0, 12.0),
    st.floats(-3.0, 3.0),
)
def test_a_slew_is_from_rest_to_rest_in_its_duration(
    shaper: str, frequency: float, damping: float, duration: float, start: float
) -> None:
    slew = BangBang(TURN, duration, shaper, frequency, damping, start)
    time = start + duration * np.array([-0.1, 0.0, 0.5, 1.0, 1.1])
    found = slew.at(time)
    assert np.allclose(found.attitude[[0, 1]], [1.0, 0.0, 0.0, 0.0], atol=1e-12)
    assert np.allclose(found.attitude[[3, 4]], TURN, atol=1e-12)
    assert np.abs(found.rate[[0, 1, 3, 4]]).max() < 1e-12
    grid = start + np.linspace(0.0, duration, 20001)
    rate = slew.at(grid).rate @ (np.array([0.5, -0.2, 0.3]) / ANGLE)
    # The rate is linear between the impulses' corners: the sum is that of trapezoids.
    assert np.trapezoid(rate, grid) == pytest.approx(ANGLE, rel=1e-6)
    # One sign of the rate throughout: a shaper's impulses are all positive.
    assert rate.min() > -1e-12


def test_rate_and_acceleration_are_the_derivatives() -> None:
    slew = BangBang(TURN, 6.0, "ZVD", 0.7, 0.05)
    time, h = np.array([0.3, 0.9, 2.2, 3.1, 4.4, 5.3]), 1e-6
    before, now, after = (slew.at(time + dt) for dt in (-h, 0.0, h))
    turned = att.to_rotation_vector(att.multiply(att.conjugate(before.attitude), after.attitude))
    assert np.allclose(turned / (2 * h), now.rate, atol=1e-8)
    assert np.allclose((after.rate - before.rate) / (2 * h), now.acceleration, atol=1e-8)


@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_shapers_leave_nothing_of_their_mode_and_zvd_little_beside_it(damping: float) -> None:
    frequency = 0.7
    # 2 1/2 periods in each half: what is worst of a bang-bang slew.
    duration = 5.0 / frequency
    slews = {name: BangBang(TURN, duration, name, frequency, damping) for name in SHAPERS}
    left = {name: left_of_a_mode(slew, frequency, damping) for name, slew in slews.items()}
    # Of the sum over a grid of 0.2 ms.
    assert max(left["ZV"], left["ZVD"]) < 2e-4 * left["none"]
    off = {name: left_of_a_mode(slew, 0.95 * frequency, damping) for name, slew in slews.items()}
    assert off["ZVD"] < 0.2 * off["ZV"] < 0.05 * off["none"]


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"shaper": "EI"}, "shaper: got 'EI', should be none, ZV or ZVD"),
        ({"shaper": "ZVD", "frequency": 0.5}, "duration: got 2 s, should be more than .* 2 s"),
        ({"damping_ratio": 1.0}, "damping_ratio"),
        ({"duration": 0.0}, "duration"),
    ],
)
def test_unfit_gains_are_refused(keys: dict[str, float], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        BangBang(**{"attitude": TURN, "duration": 2.0} | keys)
