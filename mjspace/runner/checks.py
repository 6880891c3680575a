"""Judging a flight: each check is a statistic of one logged signal over a window of time."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mjspace.contract import TICK, Array
from mjspace.errors import InputError, input_error_at
from mjspace.runner.statistic import Statistic
from mjspace.scenario.scenario import Check, EventTable, SignalRegion
from mjspace.signals import Topics, find_signal, magnitude
from mjspace.units import Quantity, Unit

Rows = Mapping[str, Mapping[str, Array]]

Outcome = Literal["PASS", "FAIL", "not measured"]

NO_CRASH = Check(name="no crash", signal="truth.crash", statistic="max", below=0.5)
"""What a vehicle over a ground is checked for, unless the scenario itself looks at that signal."""


@dataclass(frozen=True)
class Verdict:
    """A check and what was measured in the flight."""

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


def margin(check: Check, measured: float) -> float:
    """Return how far inside its nearest bound the measured value is; negative outside, or nan."""
    below = math.inf if check.below is None else float(check.below) - measured
    above = math.inf if check.above is None else measured - float(check.above)
    return math.nan if math.isnan(measured) else min(below, above)


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


def refuse_other_dimensions(
    checks: Sequence[Check],
    events: Sequence[EventTable],
    topics: Topics,
    units: Mapping[str, Mapping[str, Unit]],
) -> None:
    """Refuse bounds and targets that measure something else than their signal.

    ``units`` are by topic and field. A bound without a unit is in SI, and a signal without one may
    be anything.

    Raises:
        InputError: the first of them, with both units.
    """
    regions: dict[str, SignalRegion] = {f"checks.{n}": check for n, check in enumerate(checks)}
    regions |= {f"events.{n}": event for n, event in enumerate(events)}
    for place, region in regions.items():
        topic, field, _ = find_signal(topics, region.signal)
        unit = units.get(topic, {}).get(field)
        if unit is None:
            continue
        for key in ("below", "above", "target"):
            value = getattr(region, key, None)
            is_ratio = key != "target" and getattr(region, "relative", False)
            right = "a plain number, of a relative error" if is_ratio else f"in {unit.si}"
            for each in value if isinstance(value, list) else [value]:
                if isinstance(each, Quantity) and (is_ratio or each.unit != unit.si):
                    what = f"{each:.6g} {each.unit} for {region.signal}"
                    raise InputError(f"{place}.{key}: got {what}, should be {right}")


class Judge:
    """The checks of one vehicle's flight, judged as it flies: on every control period.

    A vehicle over a ground is checked for ``NO_CRASH`` as well.
    """

    def __init__(
        self, checks: Sequence[Check], events: Sequence[EventTable], topics: Topics
    ) -> None:
        """Begin a flight with these ``topics``.

        ``events`` are the scenario's, which checks may count from; one that never happens leaves
        nothing to measure.

        Raises:
            ValueError: a check or an event that it counts from names a signal that is not there.
        """
        if "crash" in topics.get("/truth", {}):
            own = any(check.signal == NO_CRASH.signal for check in checks)
            checks = checks if own else [*checks, NO_CRASH]
        named = [name for check in checks for name in (check.since, check.until) if name]
        self._events = {
            e.name: (e, find_signal(topics, e.signal)) for e in events if e.name in named
        }
        self._happened = dict.fromkeys(self._events, math.nan)
        self._measured = [
            (check, find_signal(topics, check.signal), Statistic(check)) for check in checks
        ]

    def add(self, time: Array, rows: Rows) -> None:
        """Go on with n > 0 control periods at ``time`` [s]; ``rows[topic][field]`` is (n, ...)."""
        stamps = np.rint(time * 1e9)  # as they stand in the log
        for name, (event, signal) in self._events.items():
            if math.isnan(self._happened[name]):
                inside = event.admits(magnitude(_numbers(rows, signal)))
                if inside.any():
                    self._happened[name] = float(stamps[np.argmax(inside)] / 1e9)
        for check, signal, statistic in self._measured:
            start, end = _window(check, self._happened)
            low = np.searchsorted(stamps, np.rint(start * 1e9), "left")
            high = np.searchsorted(stamps, np.rint(end * 1e9), "right")
            if low < high:
                statistic.add(_numbers(rows, signal)[low:high])

    def verdicts(self) -> list[Verdict]:
        """Return the verdict of each check on what has been flown so far."""
        return [self._verdict(check, statistic) for check, _, statistic in self._measured]

    def _verdict(self, check: Check, statistic: Statistic) -> Verdict:
        for name in (check.since, check.until):
            if name and math.isnan(self._happened[name]):
                return Verdict(check, math.nan, f"event {name!r} never happened")
        if not statistic.count:
            start, end = _window(check, self._happened)
            until = "the end" if end == math.inf else f"{end:.6g} s"
            return Verdict(check, math.nan, f"no sample from {start:.6g} s to {until}")
        measured = statistic.value()
        missing = f"{check.signal} is not a number" if math.isnan(measured) else ""
        return Verdict(check, measured, missing)


def _numbers(rows: Rows, signal: tuple[str, str, slice]) -> Array:
    """Return the signal's numbers (n, k)."""
    topic, field, part = signal
    values = rows[topic][field]
    return values.reshape(len(values), -1)[:, part]


def _window(check: Check, happened: Mapping[str, float]) -> tuple[float, float]:
    """Return the check's first and last instant [s], as far as what ``happened`` tells them."""
    zero = happened[check.since] if check.since else 0.0
    before = happened[check.until] - TICK if check.until else math.inf
    if math.isnan(zero):
        return math.inf, -math.inf
    end = math.inf if check.end is None else zero + check.end
    return zero + check.start, end if math.isnan(before) else min(end, before)
