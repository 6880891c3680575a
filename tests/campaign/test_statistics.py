"""The success rate, its bounds and gates, against closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from scipy import stats

from mjspace.campaign.statistics import Gate, Rate, gate, rank_correlation, spread
from mjspace.errors import InputError


def test_the_interval_is_wilsons() -> None:
    # Wilson 1927: (p + z^2/2n -+ z sqrt(p(1-p)/n + z^2/4n^2)) / (1 + z^2/n)
    p, n, z = 0.9, 50, stats.norm.ppf(0.975)
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2)) / (1 + z**2 / n)
    assert Rate(45, 50).interval() == pytest.approx((middle - half, middle + half), abs=1e-12)


@given(some.integers(0, 300), some.integers(1, 300), some.floats(0.05, 0.99))
def test_the_members_that_are_needed_are_just_enough(k: int, n: int, required: float) -> None:
    rate = Rate(min(k, n), n)
    more = rate.needed(required)
    if more is None:
        assert rate.value <= required
    elif more == 0:
        assert rate.at_least() >= required
    else:
        total = n + more
        z = stats.norm.ppf(0.95)
        spread_of_one = math.sqrt(required * (1.0 - required))
        score = (rate.value - required) / spread_of_one * np.sqrt([total - 1, total])
        assert score[0] <= z * (1.0 + 1e-9)
        assert score[1] >= z * (1.0 - 1e-9)


def test_without_a_failure_the_members_needed_are_those_of_the_textbook() -> None:
    # z^2 p0 / (1 - p0) = 1.645^2 * 99
    assert Rate(100, 100).needed(0.99) == math.ceil(stats.norm.ppf(0.95) ** 2 * 99) - 100
    assert Gate(0.99, 0.95).admits(Rate(268, 268))
    assert not Gate(0.99, 0.95).admits(Rate(267, 267))


def test_nothing_flown_shows_nothing() -> None:
    rate = Rate(0, 0)
    assert rate.interval() == (0.0, 1.0)
    assert math.isnan(rate.value)
    assert rate.needed(0.9) is None
    assert not Gate(0.5, 0.95).admits(rate)
    assert spread(np.array([np.nan])) is None


@pytest.mark.parametrize(
    "text",
    [
        "success > 0.9",
        "success >= 99 %",
        "rate >= 0.9",
        "",
        "success >= 1 @ 0.9",
        "success >= 0.9 @ 2",
    ],
)
def test_a_gate_that_cannot_be_read_is_one_line(text: str) -> None:
    with pytest.raises(InputError, match=r"--gate: got .* should be as 'success >= 0.99 @ 0.95'"):
        gate(text)


def test_a_gate_is_read() -> None:
    assert gate("success >= 0.99 @ 0.9") == Gate(0.99, 0.9)
    assert gate("success>=.5") == Gate(0.5, 0.95)


def test_a_rank_correlation_needs_what_varies() -> None:
    x = np.array([1.0, 2.0, 3.0, np.nan, 5.0])
    assert rank_correlation(x, -(x**3)) == pytest.approx(-1.0)
    assert rank_correlation(x, np.ones(5)) is None
    assert rank_correlation(x[:2], x[:2]) is None
