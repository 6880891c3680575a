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
        # max and min pass NaN on, which must fail every bound
        self._so_far = {"max": -np.inf, "peak": -np.inf, "drift": -np.inf, "min": np.inf}.get(
            what.statistic, 0.0
        )
        """The extreme value, the sum, or the last value."""
        self.count = 0

    def add(self, rows: Array) -> None:
        """Go on with n > 0 rows (n, k)."""
        what, so_far = self._what, self._so_far
        self.count += len(rows)
        if what.statistic == "final":
            rows = rows[-1:]
        if self._target is not None:
            rows = rows - self._target
        if what.statistic == "drift":
            if self._first is None:
                self._first = rows[0].copy()
            rows = rows - self._first
        values = magnitude(rows)
        if what.statistic in ("peak", "drift") or self._target is not None:
            values = np.abs(values)
        if what.statistic == "final":
            self._so_far = float(values[-1])
        elif what.statistic == "min":
            self._so_far = float(np.minimum(so_far, values.min()))
        elif what.statistic in ("mean", "rms"):
            terms = values**2 if what.statistic == "rms" else values
            # One after the other, so that the sum does not depend on how a flight is cut into
            # blocks.
            self._so_far = float(np.add.accumulate(np.concatenate([[so_far], terms]))[-1])
        else:
            self._so_far = float(np.maximum(so_far, values.max()))

    def value(self) -> float:
        """Return it; there must have been a row."""
        measured = self._so_far
        if self._what.statistic in ("mean", "rms"):
            measured /= self.count
        if self._what.statistic == "rms":
            measured = math.sqrt(measured)
        if self._what.relative and self._target is not None:
            return measured / float(np.linalg.norm(self._target))
        return measured
