"""A check's statistic over its window, gathered block by block."""

import math
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.scenario.scenario import Check
from mjspace.signals import magnitude

_SUMMED = ("mean", "rms")


class Statistic:
    """A check's statistic over the rows so far of its window; of each row what it needs alone."""

    def __init__(self, check: Check) -> None:
        self._check = check
        self._target = None if check.target is None else np.asarray(check.target, dtype=float)
        self._first: Array | None = None
        least = {"min": np.inf, "final": np.nan} | dict.fromkeys(_SUMMED, 0.0)
        self._gathered = least.get(check.statistic, -np.inf)
        self.count = 0

    def add(self, rows: Array) -> None:
        """Go on with n > 0 rows (n, k)."""
        kind = self._check.statistic
        self.count += len(rows)
        if kind == "final":
            rows = rows[-1:]
        if self._target is not None:
            rows = rows - self._target
        if kind == "drift":
            if self._first is None:
                self._first = rows[0].copy()
            rows = rows - self._first
        values = magnitude(rows)
        if kind in ("peak", "drift") or self._target is not None:
            values = np.abs(values)
        self._gathered = float(self._with(values))

    def _with(self, values: Array) -> Any:
        """Return what is gathered, with more ``values``; NaN stays, as it must fail every bound."""
        kind = self._check.statistic
        if kind == "final":
            return values[-1]
        if kind == "min":
            return np.min([self._gathered, values.min()])
        if kind not in _SUMMED:
            return np.max([self._gathered, values.max()])
        # One after the other, so that the sum does not depend on how a flight is cut into blocks.
        terms = values**2 if kind == "rms" else values
        return np.add.accumulate(np.concatenate([[self._gathered], terms]))[-1]

    def value(self) -> float:
        """Return it; there must have been a row."""
        measured = self._gathered
        if self._check.statistic in _SUMMED:
            measured /= self.count
        if self._check.statistic == "rms":
            measured = math.sqrt(measured)
        if self._check.relative and self._target is not None:
            return measured / float(np.linalg.norm(self._target))
        return measured
