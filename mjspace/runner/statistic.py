"""A check's statistic over its window, gathered block by block."""

import math

import numpy as np

from mjspace.contract import Array
from mjspace.scenario.scenario import Check
from mjspace.signals import magnitude


class Statistic:
    """A check's statistic over the rows so far of its window."""

    def __init__(self, check: Check) -> None:
        self._check = check
        self._target = None if check.target is None else np.asarray(check.target, dtype=float)
        self._first: Array | None = None
        self._total, self._peak, self._least, self._last = 0.0, -np.inf, np.inf, np.nan
        self.count = 0

    def add(self, rows: Array) -> None:
        """Go on with n > 0 rows (n, k)."""
        check = self._check
        if self._target is not None:
            rows = rows - self._target
        if self._first is None:
            self._first = rows[0].copy()
        if check.statistic == "drift":
            rows = rows - self._first
        values = magnitude(rows)
        if check.statistic in ("peak", "drift") or self._target is not None:
            values = np.abs(values)
        self.count += len(values)
        # One after the other, so that the sum does not depend on how a flight is cut into blocks.
        terms = values**2 if check.statistic == "rms" else values
        self._total = float(np.add.accumulate(np.concatenate([[self._total], terms]))[-1])
        # max and min pass NaN on, which must fail every bound
        self._peak = float(np.max([self._peak, values.max()]))
        self._least = float(np.min([self._least, values.min()]))
        self._last = float(values[-1])

    def value(self) -> float:
        """Return it; there must have been a row."""
        mean = self._total / self.count
        measured = {
            "max": self._peak,
            "peak": self._peak,
            "drift": self._peak,
            "min": self._least,
            "mean": mean,
            "rms": math.sqrt(abs(mean)),  # of squares only where the statistic is rms
            "final": self._last,
        }[self._check.statistic]
        if self._check.relative and self._target is not None:
            return measured / float(np.linalg.norm(self._target))
        return measured
