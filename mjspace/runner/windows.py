"""The windows of checks and metrics in a flight: what of each block of periods lies in them."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from mjspace.contract import TICK, Array
from mjspace.scenario.measurement import Measurement
from mjspace.scenario.scenario import EventTable
from mjspace.signals import Topics, find_signal, magnitude

Rows = Mapping[str, Mapping[str, Array]]
"""The values (n, ...) of n control periods, by topic and field."""


def numbers_of(rows: Rows, signal: tuple[str, str, slice]) -> Array:
    """Return the signal's numbers (n, k)."""
    topic, field, part = signal
    values = rows[topic][field]
    return values.reshape(len(values), -1)[:, part]


class Windows:
    """Where the windows of one flight lie, as far as it has been flown."""

    def __init__(
        self, measured: Sequence[Measurement], events: Sequence[EventTable], topics: Topics
    ) -> None:
        """Begin a flight; of the scenario's ``events`` those matter that are counted from.

        Raises:
            ValueError: one of them is of a signal that is not there.
        """
        named = [name for each in measured for name in (each.since, each.until) if name]
        self._events = {
            e.name: (e, find_signal(topics, e.signal)) for e in events if e.name in named
        }
        self._happened = dict.fromkeys(self._events, math.nan)
        self._stamps = np.empty(0)
        self._parts: dict[tuple[float, float], slice] = {}

    def add(self, time: Array, rows: Rows) -> None:
        """Go on with n > 0 control periods at ``time`` [s]."""
        self._stamps = np.rint(time * 1e9)  # as they stand in the log
        self._parts.clear()
        for name, (event, signal) in self._events.items():
            if math.isnan(self._happened[name]):
                inside = event.admits(magnitude(numbers_of(rows, signal)))
                if inside.any():
                    self._happened[name] = float(self._stamps[np.argmax(inside)] / 1e9)

    def part(self, measured: Measurement) -> slice:
        """Return which of the periods that were last added are in the window."""
        ends = self._ends(measured)
        if ends not in self._parts:  # many checks have the same
            start, end = np.rint(np.array(ends) * 1e9)
            low = int(self._stamps.searchsorted(start, "left"))
            high = int(self._stamps.searchsorted(end, "right"))
            self._parts[ends] = slice(low, max(low, high))
        return self._parts[ends]

    def never(self, measured: Measurement) -> str:
        """Return which event that the window needs has not happened; "" if all have."""
        for name in (measured.since, measured.until):
            if name and math.isnan(self._happened[name]):
                return f"event {name!r} never happened"
        return ""

    def without_sample(self, measured: Measurement) -> str:
        """Return what is said of a window in which there is no sample."""
        start, end = self._ends(measured)
        until = "the end" if end == math.inf else f"{end:.6g} s"
        return f"no sample from {start:.6g} s to {until}"

    def _ends(self, measured: Measurement) -> tuple[float, float]:
        """Return the window's first and last instant [s], as far as the events tell them."""
        zero = self._happened[measured.since] if measured.since else 0.0
        before = self._happened[measured.until] - TICK if measured.until else math.inf
        if math.isnan(zero):
            return math.inf, -math.inf
        end = math.inf if measured.end is None else zero + measured.end
        return zero + measured.start, end if math.isnan(before) else min(end, before)
