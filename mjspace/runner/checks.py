"""Judging a flight: each check is a statistic of one logged signal over a window of time."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mjspace.contract import TICK
from mjspace.errors import InputError, input_error_at
from mjspace.log.reader import Log
from mjspace.runner.statistic import Statistic
from mjspace.scenario.scenario import Check, EventTable
from mjspace.signals import Topics, by_topic, find_signal, magnitude

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
    happened = _first_times(log, [event for event in events if event.name in named])
    found = [
        None if _never(check, happened) else Statistic(check, log.topics, *_window(check, happened))
        for check in checks
    ]
    _gather(log, [statistic for statistic in found if statistic is not None])
    return [
        _verdict(check, statistic, happened) for check, statistic in zip(checks, found, strict=True)
    ]


def _first_times(log: Log, events: Sequence[EventTable]) -> dict[str, float]:
    """Return when each event's signal is in its region first [s], by its name; nan if never."""
    happened = {event.name: math.nan for event in events}
    signals = {event.name: find_signal(log.topics, event.signal) for event in events}
    fields = by_topic((topic, field) for topic, field, _ in signals.values())
    for blocks in log.blocks_of_topics(fields) if events else ():
        for event in events:
            topic, field, part = signals[event.name]
            if topic not in blocks or not math.isnan(happened[event.name]):
                continue
            block = blocks[topic]
            rows = block[field].reshape(len(block["time"]), -1)
            inside = event.admits(magnitude(rows[:, part]))
            if inside.any():
                happened[event.name] = float(block["time"][np.argmax(inside)])
        if not any(map(math.isnan, happened.values())):
            break
    return happened


def _gather(log: Log, statistics: Sequence[Statistic]) -> None:
    """Read the log once, as far as one of the windows reaches."""
    if not statistics:
        return
    start, end = min(s.start for s in statistics), max(s.end for s in statistics)
    fields = by_topic((s.topic, s.field) for s in statistics)
    for blocks in log.blocks_of_topics(fields, start, None if end == math.inf else end):
        for statistic in statistics:
            if statistic.topic in blocks:
                statistic.add(blocks[statistic.topic])


def _verdict(check: Check, statistic: Statistic | None, happened: Mapping[str, float]) -> Verdict:
    if statistic is None:
        return Verdict(check, math.nan, f"event {_never(check, happened)!r} never happened")
    if statistic.count == 0:
        until = "the end" if statistic.end == math.inf else f"{statistic.end:.6g} s"
        return Verdict(check, math.nan, f"no sample from {statistic.start:.6g} s to {until}")
    measured = statistic.value
    return Verdict(
        check, measured, f"{check.signal} is not a number" if math.isnan(measured) else ""
    )


def _never(check: Check, happened: Mapping[str, float]) -> str:
    """Return the first event that the check counts from and that never happened; else ''."""
    named = (name for name in (check.since, check.until) if name)
    return next((name for name in named if math.isnan(happened[name])), "")


def _window(check: Check, happened: Mapping[str, float]) -> tuple[float, float]:
    """Return the check's first and last instant [s]."""
    zero = happened[check.since] if check.since else 0.0
    end = math.inf if check.end is None else zero + check.end
    before = happened[check.until] - TICK if check.until else math.inf
    return zero + check.start, min(end, before)
