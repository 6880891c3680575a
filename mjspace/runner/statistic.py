"""A statistic over the window of a check or a metric, gathered block by block."""

import math

import numpy as np

from mjspace.contract import Array
from mjspace.scenario.measurement import Measurement
from mjspace.signals import magnitude


class Statistic:
    """What is measured, over the rows so far of its window."""

    def __init__(self, what: Measurement) -> None:
        self._what = what
        self._target = None if what.target is None else np.asarray(what.target, dtype=float)
        self._first: Array | None = None
        self._total, self._peak, self._least, self._last = 0.0, -np.inf, np.inf, np.nan
        self.count = 0

    def add(self, rows: Array) -> None:
        """Go on with n > 0 rows (n, k)."""
        what = self._what
        if self._target is not None:
            rows = rows - self._target
        if self._first is None:
            self._first = rows[0].copy()
        if what.statistic == "drift":
            rows = rows - self._first
        values = magnitude(rows)
        if what.statistic in ("peak", "drift") or self._target is not None:
            values = np.abs(values)
        self.count += len(values)
        # One after the other, so that the sum does not depend on how a flight is cut into blocks.
        terms = values**2 if what.statistic == "rms" else values
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
        }[self._what.statistic]
        if self._what.relative and self._target is not None:
            return measured / float(np.linalg.norm(self._target))
        return measured
