"""Judging a flight: each check is a statistic of one logged signal over a window of time."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mjspace.contract import TICK, Array
from mjspace.errors import InputError, input_error_at
from mjspace.log.reader import Log
from mjspace.scenario.scenario import Check, EventTable
from mjspace.signals import Topics, find_signal, magnitude

Outcome = Literal["PASS", "FAIL", "not measured"]

NO_CRASH = Check(name="no crash", signal="truth.crash", statistic="max", below=0.5)
"""What a vehicle over a ground is checked for, unless the scenario itself looks at that signal."""


@dataclass(frozen=True)
class Verdict:
    """A check and what was measured from the log."""

    check: Check
    measured: float
    """nan where there is nothing to judge."""
    missing: str = ""
    """Why there is nothing to judge."""

    @property
    def outcome(self) -> Outcome:
        """PASS if the measured value is within its bounds; neither if nothing was measured."""
        if math.isnan(self.measured):
            return "not measured"
        return "PASS" if self.check.admits(self.measured) else "FAIL"

    @property
    def as_expected(self) -> bool:
        """Whether it came out as the scenario expects; what was not measured never does."""
        return self.outcome == self.check.expected

    @property
    def bound(self) -> str:
        """The bounds as a person reads them."""
        parts = [
            f"{sign} {bound:.6g}"
            for sign, bound in (("<", self.check.below), (">", self.check.above))
            if bound is not None
        ]
        return " and ".join(parts)

    @property
    def line(self) -> str:
        """The verdict in one line."""
        if self.missing:
            return f"{self.outcome} {self.check.name}: {self.missing}"
        line = f"{self.outcome} {self.check.name}: {self.measured:.6g} (required {self.bound})"
        if self.check.expected == "PASS":
            return line
        how = "as expected" if self.as_expected else "expected to FAIL"
        return f"{line}, {how}: {self.check.because}"


def refuse_unknown(checks: Sequence[Check], topics: Topics) -> None:
    """Refuse checks of signals that a log with these topics will not have.

    Raises:
        InputError: the first of them, with the near names.
    """
    for number, check in enumerate(checks):
        with input_error_at(f"checks.{number}.signal"):
            _, _, part = find_signal(topics, check.signal)
        size = part.stop - part.start
        count = 1 if check.target is None else np.size(check.target)
        if count not in (1, size):
            raise InputError(f"checks.{number}.target: {count} numbers, {check.signal} has {size}")


def judge(log: Log, checks: Sequence[Check], events: Sequence[EventTable] = ()) -> list[Verdict]:
    """Return the verdict of each check, from the log alone, one chunk of it in memory at a time.

    A vehicle over a ground is checked for ``NO_CRASH`` as well.

    ``events`` are the scenario's, which checks may count from; one that never happened leaves
    nothing to measure.

    Raises:
        ValueError: a check or an event names a signal that the log does not have.
    """
    if "crash" in log.topics.get("/truth", {}):
        own = any(check.signal == NO_CRASH.signal for check in checks)
        checks = checks if own else [*checks, NO_CRASH]
    named = [name for check in checks for name in (check.since, check.until) if name]
    happened = {event.name: _first(log, event) for event in events if event.name in named}
    return [_verdict(log, check, happened) for check in checks]


def _first(log: Log, event: EventTable) -> float:
    """Return when the event's signal is in its region first [s]; nan if never."""
    topic, field, part = find_signal(log.topics, event.signal)
    for block in log.blocks(topic, [field], start=None, end=None):
        rows = block[field].reshape(len(block["time"]), -1)
        inside = event.admits(magnitude(rows[:, part]))
        if inside.any():
            return float(block["time"][np.argmax(inside)])
    return math.nan


def _verdict(log: Log, check: Check, happened: Mapping[str, float]) -> Verdict:
    never = [name for name in (check.since, check.until) if name and math.isnan(happened[name])]
    if never:
        return Verdict(check, math.nan, f"event {never[0]!r} never happened")
    start, end = _window(check, happened)
    count, measured = _measure(log, check, start, end)
    if count == 0:
        until = "the end" if end == math.inf else f"{end:.6g} s"
        return Verdict(check, math.nan, f"no sample from {start:.6g} s to {until}")
    return Verdict(
        check, measured, f"{check.signal} is not a number" if math.isnan(measured) else ""
    )


def _window(check: Check, happened: Mapping[str, float]) -> tuple[float, float]:
    """Return the check's first and last instant [s]."""
    zero = happened[check.since] if check.since else 0.0
    end = math.inf if check.end is None else zero + check.end
    before = happened[check.until] - TICK if check.until else math.inf
    return zero + check.start, min(end, before)


def _measure(log: Log, check: Check, start: float, end: float) -> tuple[int, float]:
    """Return how many samples the window has, and their statistic."""
    topic, field, part = find_signal(log.topics, check.signal)
    target = None if check.target is None else np.asarray(check.target, dtype=float)
    count, total, peak, least, last = 0, 0.0, -np.inf, np.inf, np.nan
    first: Array | None = None
    for block in log.blocks(topic, [field], start=start, end=None if end == math.inf else end):
        rows = block[field].reshape(len(block["time"]), -1)[:, part]
        if target is not None:
            rows = rows - target
        if first is None:
            first = rows[0]
        if check.statistic == "drift":
            rows = rows - first
        values = magnitude(rows)
        if check.statistic in ("peak", "drift") or target is not None:
            values = np.abs(values)
        count += len(values)
        total += float(np.sum(values**2 if check.statistic == "rms" else values))
        # max and min pass NaN on, which must fail every bound
        peak, least, last = (
            float(np.max([peak, values.max()])),
            float(np.min([least, values.min()])),
            float(values[-1]),
        )
    if count == 0:
        return 0, math.nan
    scale = float(np.linalg.norm(target)) if check.relative and target is not None else 1.0
    measured = {
        "max": peak,
        "peak": peak,
        "drift": peak,
        "min": least,
        "mean": total / count,
        "rms": math.sqrt(abs(total / count)),  # of squares only where the statistic is rms
        "final": last,
    }[check.statistic]
    return count, measured / scale
