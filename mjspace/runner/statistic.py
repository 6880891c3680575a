"""A check's statistic over its window, gathered chunk by chunk."""

import math
from collections.abc import Mapping

import numpy as np

from mjspace.contract import Array
from mjspace.scenario.scenario import Check
from mjspace.signals import Topics, find_signal, magnitude


class Statistic:
    """What a check measures, of the blocks of a log that are added in their order."""

    def __init__(self, check: Check, topics: Topics, start: float, end: float) -> None:
        """Begin without a sample; the window is from ``start`` to ``end`` [s], both included.

        Raises:
            ValueError: a log of these topics does not have the signal.
        """
        self.topic, self.field, self._part = find_signal(topics, check.signal)
        self.start, self.end = start, end
        self.count = 0
        """How many samples are in the window."""
        self._check = check
        self._target = None if check.target is None else np.asarray(check.target, dtype=float)
        self._first: Array | None = None
        self._total, self._peak, self._least, self._last = 0.0, -math.inf, math.inf, math.nan

    def add(self, block: Mapping[str, Array]) -> None:
        """Add the rows of a block of the topic that are in the window."""
        check, stamps = self._check, np.rint(1e9 * block["time"])  # as the log has them, ns
        low = np.searchsorted(stamps, np.rint(1e9 * self.start), "left")
        high = np.searchsorted(stamps, np.rint(1e9 * self.end), "right")
        if low >= high:
            return
        rows = block[self.field].reshape(len(stamps), -1)[low:high, self._part]
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
        self._total += float(np.sum(values**2 if check.statistic == "rms" else values))
        # max and min pass NaN on, which must fail every bound
        self._peak = float(np.max([self._peak, values.max()]))
        self._least = float(np.min([self._least, values.min()]))
        self._last = float(values[-1])

    @property
    def value(self) -> float:
        """The statistic; nan without a sample."""
        if self.count == 0:
            return math.nan
        relative = self._check.relative and self._target is not None
        scale = float(np.linalg.norm(self._target)) if relative else 1.0  # type: ignore[arg-type]
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
        return measured / scale
