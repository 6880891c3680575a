"""The answer of a campaign, as a table for a person or as plain data for another program."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from mjspace.campaign.flights import log_of
from mjspace.campaign.results import WALL_TIME, JudgedResults, missing_column, value_column
from mjspace.campaign.robustness import relative
from mjspace.campaign.sensitivity import SAMPLING, Sensitivity, independent, indices
from mjspace.campaign.statistics import CONFIDENCE, Gate, Rate, Spread, rank_correlation, spread
from mjspace.contract import Array
from mjspace.errors import printable
from mjspace.scenario.scenario import Check

REQUIRED = (0.9, 0.99, 0.999)
"""Rates for which is said how many members are missing, where no gate names one."""
WORST = 5
QUANTILES = (">min", ">5 %", ">median", ">95 %", ">max")


@dataclass(frozen=True)
class CheckFigures:
    """What a check showed over all members."""

    name: str
    bound: str
    failed: int
    """Members whose check came out otherwise than expected."""
    measured: Spread | None
    correlations: dict[str, float | None]
    """Spearman's, of each number drawn with the margin."""


@dataclass(frozen=True)
class MetricFigures:
    """What a metric came to over all members."""

    name: str
    missing: int
    """Members without a value."""
    why: str
    """Why the first of them has none."""
    values: Spread | None
    correlations: dict[str, float | None]
    """Spearman's, of each number drawn with the value."""


@dataclass(frozen=True)
class Worst:
    """One of the members with the least margins."""

    member: int
    passed: bool
    why: str
    """Its trouble, or its worst check."""
    log: str
    """Empty where none was kept."""


@dataclass(frozen=True)
class Answer:
    """How often the scenario works."""

    rate: Rate
    interval: tuple[float, float]
    needed: dict[float, int | None]
    """For each required rate how many members are still missing; None: at this rate no number."""
    confidence: float
    troubled: int
    """Members that ended early."""
    checks: list[CheckFigures]
    metrics: list[MetricFigures]
    sensitivities: list[Sensitivity]
    """Of each margin and each metric, where the sampling allows."""
    worst: list[Worst]
    seconds: float
    """Of wall time, of all flights together."""
    gate: Gate | None
    folder: Path

    @property
    def passed(self) -> bool:
        """Whether the gate is met; without one, whether every member succeeded."""
        if self.gate is not None:
            return self.gate.admits(self.rate)
        return self.rate.successes == self.rate.members > 0


def answer(store: JudgedResults, gate: Gate | None) -> Answer:
    """Return what the members flown so far show; a column at a time is in memory."""
    passed = store.column("passed")
    keys = [each.name for each in store.scenario.dispersions]
    exchanged = store.scenario.sampling == SAMPLING
    members = store.column("member")
    own = passed[independent(members, len(keys))] if exchanged else passed
    rate = Rate(int(own.sum()), len(own))
    confidence = CONFIDENCE if gate is None else gate.confidence
    required = REQUIRED if gate is None else (gate.required,)
    trouble = np.array([bool(t) for t in store.read(["trouble"])["trouble"].to_pylist()], bool)
    least, checks = np.where(trouble, -np.inf, np.inf), []
    names = np.full(len(passed), -1)
    for number, (name, check) in enumerate(store.checks.items()):
        margins = store.column(f"{name}: margin")
        of_bound = relative(check, margins)
        outcomes = store.read([f"{name}: verdict"])[f"{name}: verdict"].to_pylist()
        wrong = np.array([outcome != check.expected for outcome in outcomes], dtype=bool)
        lower = of_bound < least
        least, names = np.where(lower, of_bound, least), np.where(lower, number, names)
        correlations = {d: rank_correlation(store.column(d), margins) for d in store.draws}
        measured = spread(store.column(f"{name}: measured"))
        checks.append(CheckFigures(name, _bound(check), int(wrong.sum()), measured, correlations))
    order = np.lexsort((least, passed))[:WORST]
    return Answer(
        rate,
        rate.interval(confidence),
        {each: rate.needed(each, confidence) for each in required},
        confidence,
        int(trouble.sum()),
        checks,
        [_metric(store, metric.name) for metric in store.scenario.metrics],
        _sensitivities(store, keys, members, confidence) if exchanged else [],
        [_worst(store, int(members[i]), int(names[i])) for i in order],
        float(store.column(WALL_TIME).sum()),
        gate,
        store.folder,
    )


def _metric(store: JudgedResults, name: str) -> MetricFigures:
    values, column = store.column(value_column(name)), missing_column(name)
    correlations = {draw: rank_correlation(store.column(draw), values) for draw in store.draws}
    reasons = store.read([column])[column].to_pylist()
    why = next((reason for reason in reasons if reason), "")
    return MetricFigures(name, int(np.isnan(values).sum()), why, spread(values), correlations)


def _sensitivities(
    store: JudgedResults, keys: Sequence[str], members: Array, confidence: float
) -> list[Sensitivity]:
    """Return the indices of what the members up to the first that is missing show."""
    columns = {f"margin of {name}": f"{name}: margin" for name in store.checks}
    columns |= {metric.name: value_column(metric.name) for metric in store.scenario.metrics}
    first = int(np.argmin(np.append(members, np.inf) == np.arange(len(members) + 1)))
    return [
        indices(name, keys, store.column(column)[:first], confidence)
        for name, column in columns.items()
    ]


def _worst(store: JudgedResults, member: int, check: int) -> Worst:
    row = store.row(member)
    why = row["trouble"]
    if not why and check >= 0:
        name = list(store.checks)[check]
        measured = row[f"{name}: measured"]
        value = "not measured" if measured is None else f"{measured:.4g}"
        why = f"{name}: {value} (required {_bound(store.checks[name])})"
    log = log_of(store.folder, member)
    return Worst(member, row["passed"], why, str(log) if log.is_file() else "")


def _bound(check: Check) -> str:
    bounds = (("<", check.below), (">", check.above))
    return " and ".join(f"{sign} {bound:.4g}" for sign, bound in bounds if bound is not None)


def data(found: Answer) -> dict[str, Any]:
    """Return the answer as ``--json`` prints it."""
    return {
        "passed": found.passed,
        "gate": None if found.gate is None else str(found.gate),
        "members": found.rate.members,
        "successes": found.rate.successes,
        "rate": None if math.isnan(found.rate.value) else found.rate.value,
        "interval": list(found.interval),
        "at_least": found.rate.at_least(found.confidence),
        "confidence": found.confidence,
        "needed": [{"rate": rate, "members": more} for rate, more in found.needed.items()],
        "ended_early": found.troubled,
        "checks": [dataclasses.asdict(check) for check in found.checks],
        "metrics": [dataclasses.asdict(metric) for metric in found.metrics],
        "sensitivities": [dataclasses.asdict(each) for each in found.sensitivities],
        "worst": [dataclasses.asdict(worst) for worst in found.worst],
        "out": str(found.folder),
    }


def show(found: Answer) -> None:
    """Print the answer."""
    console = Console(highlight=False)
    rate, (low, high) = found.rate, found.interval
    percent = f"{100.0 * found.confidence:g} %"
    console.print(
        f"{rate.successes} of {rate.members} succeed: {rate.value:.4g}, "
        f"{percent} interval {low:.4g} to {high:.4g}"
        + (f"; {found.troubled} ended early" if found.troubled else "")
    )
    for required, more in found.needed.items():
        shown = f"at least {required:g} with {percent} confidence"
        if more == 0:
            console.print(f"  {shown}: shown")
        elif more is None:
            console.print(f"  {shown}: not at this rate")
        else:
            console.print(f"  {shown}: {more} more members at this rate")
    _show_checks(console, found)
    _show_metrics(console, found)
    for sensitivity in found.sensitivities:
        _show_sensitivity(console, sensitivity, percent)
    table = _table("worst", ">member", "verdict", "why", "log")
    for each in found.worst:
        verdict = "[green]PASS[/]" if each.passed else "[bold red]FAIL[/]"
        log = str(Path(each.log).relative_to(found.folder)) if each.log else "-"
        table.add_row("", str(each.member), verdict, _plain(each.why), log)
    console.print(table)
    if found.gate is not None:
        word = "[green]met[/]" if found.passed else "[bold red]not met[/]"
        bound = rate.at_least(found.confidence)
        console.print(f"gate {found.gate}: {word}, at least {bound:.6g} is shown")


def _show_checks(console: Console, found: Answer) -> None:
    table = _table(">", "check", ">failed", *QUANTILES)
    for number, check in enumerate(found.checks, 1):
        name = _plain(f"{check.name} {check.bound}")
        table.add_row(str(number), name, str(check.failed), *_cells(check.measured))
    console.print(table)
    _show_correlations(console, "the margin of check", found.checks)


def _show_metrics(console: Console, found: Answer) -> None:
    if not found.metrics:
        return
    table = _table(">", "metric", ">missing", *QUANTILES)
    for number, metric in enumerate(found.metrics, 1):
        row = (_plain(metric.name), str(metric.missing), *_cells(metric.values))
        table.add_row(str(number), *row)
    console.print(table)
    for metric in found.metrics:
        if metric.missing:
            why = f"{metric.name}: {metric.missing} members without: {metric.why}"
            console.print(printable(why), markup=False)
    _show_correlations(console, "metric", found.metrics)


def _cells(values: Spread | None) -> list[str]:
    return [f"{v:.3g}" for v in dataclasses.astuple(values)] if values else ["-"] * 5


def _show_correlations(
    console: Console, what: str, figures: Sequence[CheckFigures | MetricFigures]
) -> None:
    draws = list(figures[0].correlations) if figures else []
    if not draws:
        return
    numbers = [f">{number}" for number in range(1, len(figures) + 1)]
    table = _table(f"rank correlation with {what}", *numbers)
    for draw in draws:
        cells = [each.correlations[draw] for each in figures]
        table.add_row(_plain(draw), *("-" if c is None else f"{c:+.2f}" for c in cells))
    console.print(table)


def _show_sensitivity(console: Console, found: Sensitivity, percent: str) -> None:
    name = _plain(found.name)
    if found.why:
        console.print(f"Sobol indices of {name}: none, {found.why}")
        return
    titles = (">first order", f">{percent} interval", ">total", f">{percent} interval")
    table = _table(f"Sobol indices of {name}", *titles)
    for key, first in found.first.items():
        orders = (first, found.total[key])
        cells = [c for i in orders for c in (f"{i.value:.3f}", f"{i.low:.3f} to {i.high:.3f}")]
        table.add_row(_plain(key), *cells)
    console.print(table)


def _table(*titles: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in titles:
        is_number = title.startswith(">")
        table.add_column(
            title.lstrip(">"),
            justify="right" if is_number else "left",
            no_wrap=is_number or title == "log",
        )
    return table


def _plain(text: str) -> str:
    return escape(printable(text))
