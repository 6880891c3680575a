"""What a campaign shows: a success rate, its confidence interval, and what the checks depend on."""

import math
import re
from dataclasses import dataclass

import numpy as np
from scipy import stats

from mjspace.contract import Array
from mjspace.errors import InputError

CONFIDENCE = 0.95
_NUMBER = r"(\d+(?:\.\d*)?|\.\d+)"


@dataclass(frozen=True)
class Rate:
    """How many of ``members`` succeeded."""

    successes: int
    members: int

    @property
    def value(self) -> float:
        """The success rate; nan without members."""
        return self.successes / self.members if self.members else math.nan

    def interval(self, confidence: float = CONFIDENCE) -> tuple[float, float]:
        """Return the two-sided Wilson interval of the probability of success."""
        if not self.members:
            return 0.0, 1.0
        test = stats.binomtest(self.successes, self.members)
        found = test.proportion_ci(confidence_level=confidence, method="wilson")
        return float(found.low), float(found.high)

    def at_least(self, confidence: float = CONFIDENCE) -> float:
        """Return the one-sided Wilson bound: the probability of success is that or more."""
        if not self.members:
            return 0.0
        test = stats.binomtest(self.successes, self.members, alternative="greater")
        return float(test.proportion_ci(confidence_level=confidence, method="wilson").low)

    def needed(self, required: float, confidence: float = CONFIDENCE) -> int | None:
        """Return how many members more show the ``required`` rate, if they succeed at this rate.

        None: at this rate, no number does. The one-sided Wilson bound is the rate p0 for which
        p - p0 = z sqrt(p0 (1 - p0) / n): Wilson 1927, solved for n.
        """
        if self.at_least(confidence) >= required:
            return 0
        if not self.value > required:
            return None
        z = float(stats.norm.ppf(confidence))
        total = z**2 * required * (1.0 - required) / (self.value - required) ** 2
        return max(1, math.ceil(total * (1.0 - 1e-12)) - self.members)


@dataclass(frozen=True)
class Gate:
    """A success rate that is to be shown, and the confidence with which."""

    required: float
    confidence: float

    def admits(self, rate: Rate) -> bool:
        """Return whether the one-sided Wilson bound reaches the required rate."""
        return rate.at_least(self.confidence) >= self.required

    def __str__(self) -> str:
        return f"success >= {self.required:g} @ {self.confidence:g}"


def gate(text: str) -> Gate:
    """Return the gate that ``"success >= 0.99 @ 0.95"`` says; the confidence is 0.95 if left out.

    Raises:
        InputError: it says none.
    """
    found = re.fullmatch(rf"\s*success\s*>=\s*{_NUMBER}\s*(?:@\s*{_NUMBER}\s*)?", text)
    right = "should be as 'success >= 0.99 @ 0.95'"
    if found is None:
        raise InputError(f"--gate: got {text!r}, {right}")
    required, confidence = float(found[1]), float(found[2] or CONFIDENCE)
    if not (0.0 < required < 1.0 and 0.0 < confidence < 1.0):
        raise InputError(f"--gate: got {text!r}, {right}: numbers between 0 and 1")
    return Gate(required, confidence)


@dataclass(frozen=True)
class Spread:
    """The distribution of a measured value over the members that have one."""

    least: float
    low: float
    """5 % are less."""
    median: float
    high: float
    """5 % are more."""
    largest: float


def spread(values: Array) -> Spread | None:
    """Return how the ``values`` (n,) are distributed; None where all are nan."""
    finite = values[~np.isnan(values)]
    if not len(finite):
        return None
    return Spread(*map(float, np.quantile(finite, [0.0, 0.05, 0.5, 0.95, 1.0])))


def rank_correlation(one: Array, other: Array) -> float | None:
    """Return Spearman's rank correlation over the members that have both values, (n,) each.

    None where there are less than three of them, or one of both is always the same.
    """
    both = ~(np.isnan(one) | np.isnan(other))
    one, other = one[both], other[both]
    if len(one) < 3 or np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return None
    return float(stats.spearmanr(one, other).statistic)
