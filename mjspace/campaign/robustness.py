"""By how much a flight passes its checks: one number, negative where it does not."""

from collections.abc import Sequence
from math import inf

import numpy as np

from mjspace.contract import Array
from mjspace.runner.checks import Verdict, margin
from mjspace.scenario.scenario import Check


def relative(check: Check, margins: Array) -> Array:
    """Return margins over the size of the bound, to compare checks: half the width of two bounds.

    What was expected to fail is worst where it holds; what was not measured is worst of all.
    """
    bounds = [float(b) for b in (check.below, check.above) if b is not None]
    size = abs(bounds[0]) if len(bounds) == 1 else (bounds[0] - bounds[1]) / 2.0
    sign = 1.0 if check.expected == "PASS" else -1.0
    return np.where(np.isnan(margins), -inf, sign * margins / (size or 1.0))


def of_flight(verdicts: Sequence[Verdict], trouble: str = "") -> float:
    """Return the least relative margin of a flight; -inf where it ended early."""
    if trouble or not verdicts:
        return -inf
    margins = [(v.check, np.array([margin(v.check, v.measured)])) for v in verdicts]
    return min(float(relative(check, values)[0]) for check, values in margins)
