"""Judging a flight: a check is a statistic of one signal over a window, or a formula of several."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from mjspace.contract import Array
from mjspace.errors import InputError, input_error_at
from mjspace.runner.formula import Monitor, formula_of
from mjspace.runner.metrics import Functions, Measured, Meter
from mjspace.runner.statistic import Statistic
from mjspace.runner.windows import Rows, Windows, numbers_of
from mjspace.scenario.metrics import Metric
from mjspace.scenario.scenario import Check, EventTable
from mjspace.signals import Topics, find_signal, magnitude
from mjspace.units import Quantity, Unit

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
        if check.formula is not None:
            continue
        with input_error_at(f"checks.{number}.signal"):
            _, _, part = find_signal(topics, check.signal)
        size = part.stop - part.start
        count = 1 if check.target is None else np.size(check.target)
        if count not in (1, size):
            raise InputError(f"checks.{number}.target: {count} numbers, {check.signal} has {size}")


def refuse_unfit_formulas(
    checks: Sequence[Check],
    topics: Topics,
    units: Mapping[str, Mapping[str, Unit]],
    period: float,
) -> None:
    """Refuse formulas of signals that there are not, or with numbers of another dimension.

    Raises:
        InputError: the first of them.
    """
    for number, check in enumerate(checks):
        if check.formula is None or check.signals is None:
            continue
        with input_error_at(f"checks.{number}.formula"):
            for atom in formula_of(check, topics, period).atoms:
                topic, field, _ = find_signal(topics, check.signals[atom.name])
                unit, bound = units.get(topic, {}).get(field), atom.bound
                if unit and isinstance(bound, Quantity) and bound.unit != unit.si:
                    what = f"{bound:.6g} {bound.unit} for {atom.name}"
                    raise ValueError(f"got {what}, should be in {unit.si}")


def refuse_other_dimensions(
    checks: Sequence[Check],
    events: Sequence[EventTable],
    topics: Topics,
    units: Mapping[str, Mapping[str, Unit]],
    metrics: Sequence[Metric] = (),
) -> None:
    """Refuse bounds and targets that measure something else than their signal.

    ``units`` are by topic and field. A bound without a unit is in SI, and a signal without one may
    be anything.

    Raises:
        InputError: the first of them, with both units.
    """
    regions: dict[str, Check | EventTable | Metric] = {
        **{f"checks.{n}": check for n, check in enumerate(checks)},
        **{f"events.{n}": event for n, event in enumerate(events)},
        **{f"metrics.{n}": metric for n, metric in enumerate(metrics)},
    }
    for place, region in regions.items():
        if not region.signal:  # a formula, or a function
            continue
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
    """The checks and metrics of one vehicle's flight, followed on every control period.

    A vehicle over a ground is checked for ``NO_CRASH`` as well.
    """

    def __init__(
        self,
        checks: Sequence[Check],
        events: Sequence[EventTable],
        topics: Topics,
        metrics: Sequence[Metric] = (),
        functions: Functions = MappingProxyType({}),
        period: float = math.nan,
    ) -> None:
        """Begin a flight with these ``topics``.

        ``events`` are the scenario's, which checks and metrics may count from; one that never
        happens leaves nothing to measure. ``functions`` are those of the metrics, the control
        ``period`` [s] is for formulas.

        Raises:
            ValueError: a check, a metric, or an event that one counts from names a signal that is
                not there.
        """
        if "crash" in topics.get("/truth", {}):
            own = any(check.signal == NO_CRASH.signal for check in checks)
            checks = checks if own else [*checks, NO_CRASH]
        self._windows = Windows([*checks, *metrics], events, topics)
        self._measured = [(check, _gathered(check, topics, period)) for check in checks]
        self._meter = Meter(metrics, functions, topics)

    def add(self, time: Array, rows: Rows) -> None:
        """Go on with n > 0 control periods at ``time`` [s]; ``rows[topic][field]`` is (n, ...)."""
        self._windows.add(time, rows)
        for check, gathered in self._measured:
            part = self._windows.part(check)
            if part.start < part.stop:
                gathered.add(rows, part)
        self._meter.add(self._windows, time, rows)

    def verdicts(self) -> list[Verdict]:
        """Return the verdict of each check on what has been flown so far."""
        return [self._verdict(check, gathered) for check, gathered in self._measured]

    def metrics(self) -> list[Measured]:
        """Return what each metric came to in what has been flown so far."""
        return self._meter.measured(self._windows)

    def _verdict(self, check: Check, gathered: "_OfSignal | _OfFormula") -> Verdict:
        if never := self._windows.never(check):
            return Verdict(check, math.nan, never)
        if not gathered.begun:
            return Verdict(check, math.nan, self._windows.without_sample(check))
        measured = gathered.value()
        if measured is None:
            return Verdict(check, math.nan, "the flight ends before what the formula looks ahead")
        of = check.signal or "the formula"
        return Verdict(check, measured, f"{of} is not a number" if math.isnan(measured) else "")


class _OfSignal:
    """The statistic of a check's signal."""

    def __init__(self, check: Check, topics: Topics) -> None:
        self._signal, self._statistic = find_signal(topics, check.signal), Statistic(check)

    @property
    def begun(self) -> bool:
        """Whether there was a sample."""
        return self._statistic.count > 0

    def add(self, rows: Rows, part: slice) -> None:
        """Go on with a part of the rows."""
        self._statistic.add(numbers_of(rows, self._signal)[part])

    def value(self) -> float | None:
        """Return it."""
        return self._statistic.value()


class _OfFormula:
    """The robustness of a check's formula."""

    def __init__(self, check: Check, topics: Topics, period: float) -> None:
        named = check.signals or {}
        self._signals = {name: find_signal(topics, signal) for name, signal in named.items()}
        self._monitor = Monitor(formula_of(check, topics, period))
        self.begun = False

    def add(self, rows: Rows, part: slice) -> None:
        """Go on with a part of the rows."""
        self.begun = True
        self._monitor.add(
            {
                name: magnitude(numbers_of(rows, signal)[part])
                for name, signal in self._signals.items()
            }
        )

    def value(self) -> float | None:
        """Return it; None where no sample has all around it that the formula looks at."""
        value = self._monitor.value()
        return value if self._monitor.count else None


def _gathered(check: Check, topics: Topics, period: float) -> _OfSignal | _OfFormula:
    if check.formula is None:
        return _OfSignal(check, topics)
    return _OfFormula(check, topics, period)
