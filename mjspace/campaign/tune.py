"""Tuning: gains that minimize what flights show, over several draws of the dispersions."""

import math
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mjspace.campaign import robustness
from mjspace.campaign.flights import judged, same
from mjspace.campaign.members import Campaign, population, value_at
from mjspace.campaign.requirement import objective, requirement
from mjspace.campaign.search import minimize
from mjspace.campaign.written import write_scenario
from mjspace.contract import Array
from mjspace.errors import FlightError, InputError, input_error_at, nearest
from mjspace.interrupts import Interrupted, on_signals
from mjspace.runner import workers
from mjspace.scenario.dispersions import path_of
from mjspace.scenario.loading import validated
from mjspace.scenario.metrics import Metric
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.units import to_si

WORSE = 1e9
"""What a flight counts as that misses a requirement, and more by how far it does."""
_ANY = 1e300
Told = Callable[[int, int], None]
"""A function that is called with how many flights there were, and how many missed a requirement."""


@dataclass(frozen=True)
class Varied:
    """A number of the scenario that is tuned, in SI."""

    key: str
    low: float
    high: float
    unit: str = ""
    """SI, of a bound that is a quantity; "" where both are plain numbers."""

    @property
    def path(self) -> tuple[str, ...]:
        """Of the key."""
        return path_of(self.key)

    def at(self, part: float) -> float:
        """Return the value at a ``part`` of the way, of the logarithm's where both are above 0."""
        if self.low > 0.0:
            return float(self.low * (self.high / self.low) ** part)
        return float(self.low + part * (self.high - self.low))

    def written(self, value: float) -> float | str:
        """Return the value as the scenario reads it, which judges its unit."""
        return f"{value!r} {self.unit}" if self.unit else value


@dataclass(frozen=True)
class Goal:
    """What is minimized, and what has to hold."""

    minimized: str
    """As ``rms(truth.attitude_error)``; or the name of a metric of the scenario."""
    required: tuple[str, ...]
    """As ``requirement`` reads them."""

    def checks(self, metrics: Sequence[Metric]) -> list[dict[str, Any]]:
        """Return the checks of each flight; that of the objective first, where it is no metric.

        Raises:
            InputError: one is not of the form that it should have.
        """
        found = [requirement(text) for text in self.required]
        tables = [check.model_dump(exclude_defaults=True) for check in found]
        if self.is_one_of(metrics):
            return tables
        if metrics and "(" not in self.minimized:
            near = nearest(self.minimized, [metric.name for metric in metrics])
            raise InputError(f"--minimize {self.minimized!r}: no metric of that name{near}")
        statistic, signal = objective(self.minimized, "--minimize")
        table = {"name": self.minimized, "signal": signal, "statistic": statistic, "below": _ANY}
        return [table, *tables]

    def is_one_of(self, metrics: Sequence[Metric]) -> bool:
        """Return whether a metric is minimized."""
        return any(metric.name == self.minimized for metric in metrics)


@dataclass(frozen=True)
class Shown:
    """What the objective was over some draws."""

    mean: float
    largest: float
    missed: int
    """Draws in which a requirement was missed, or the flight ended early."""


@dataclass(frozen=True)
class Tuned:
    """What tuning found; before and after are over draws that it was not tuned on."""

    values: dict[str, float]
    """By key, in SI."""
    own: dict[str, Any]
    """The scenario's own."""
    before: Shown
    after: Shown
    better: int
    """Draws of those in which the objective is less after."""
    flights: int


def varied(text: str) -> Varied:
    """Return what ``law.rate_gain=1..100`` says; the bounds are in SI, or quantities.

    Raises:
        InputError: it says nothing of that kind.
    """
    found = re.fullmatch(r"\s*([^=\s]+)\s*=\s*(.+?)\s*\.\.\s*(.+?)\s*", text)
    with input_error_at(f"--vary {text}"):
        if found is None:
            raise ValueError("should be as 'law.rate_gain=1..100'")
        (low, unit), (high, other) = (_number(each) for each in found.groups()[1:])
        if unit and other and unit != other:
            raise ValueError(f"{unit} and {other}: both bounds should be of one dimension")
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise ValueError(f"{low:g} should be less than {high:g}")
        path_of(found[1])
    return Varied(found[1], low, high, unit or other)


def tune(
    campaign: Campaign,
    what: Sequence[Varied],
    goal: Goal,
    *,
    draws: int,
    fresh: int,
    processes: int | None = None,
    told: Told = lambda flown, missed: None,
) -> Tuned:
    """Minimize the mean objective over the first ``draws`` members, by ``campaign.count`` trials.

    Each trial flies all of them. What is found is compared with the scenario as it is on ``fresh``
    other members.

    Raises:
        InputError: bad input, in one line.
        FlightError: a process was killed.
        Interrupted: a signal ended it; nothing has been tuned.
    """
    members = population(campaign, alike=True)
    draws = draws if members.dispersions else 1
    own: dict[str, Any] = {}
    for each in what:
        if each.key in own:
            raise InputError(f"--vary {each.key}: is given twice")
        with input_error_at("--vary"):
            found = value_at(members.written, each.path)
            if isinstance(found, bool) or not (found is None or isinstance(found, int | float)):
                raise ValueError(f"{each.key} is {found!r}, should be a number")
            own[each.key] = found
        if any(each.path in dispersion.paths for dispersion in members.dispersions):
            raise InputError(f"--vary {each.key}: it is dispersed")
    members.with_values({each.path: each.written(each.low) for each in what}).member(0)
    trials: dict[tuple[float, ...], float] = {}
    with on_signals() as stop, workers.team(__name__, stop, processes) as make:
        flying = _Flying((campaign, members.identity, goal), make, told)
        first = range(draws)

        def evaluate(points: Array) -> Array:
            chosen = [{v.key: v.at(float(x)) for v, x in zip(what, p, strict=True)} for p in points]
            found = flying.fly([(values, number) for values in chosen for number in first])
            means: Array = found.reshape(len(points), len(first)).mean(axis=1)
            trials.update(zip((tuple(c.values()) for c in chosen), means.tolist(), strict=True))
            return means

        nominal = flying.fly([({}, 0)])
        if stop():
            raise Interrupted(stop.signal)
        if not np.isfinite(nominal).all():
            raise InputError(f"{members.path}: {goal.minimized} is not a number")
        search = minimize(evaluate, len(what), campaign.count, members.scenario.seed, patience=None)
        for _ in search:
            if stop():
                raise Interrupted(stop.signal)
        best = min(trials, key=lambda key: trials[key])
        values = dict(zip((each.key for each in what), best, strict=True))
        others = range(draws, draws + (fresh if members.dispersions else 0)) or first
        before, after = (
            flying.fly([(chosen, number) for number in others]) for chosen in ({}, values)
        )
        if stop():
            raise Interrupted(stop.signal)
    return Tuned(
        values=values,
        own=own,
        before=_shown(before),
        after=_shown(after),
        better=int(np.sum(after < before)),
        flights=flying.count,
    )


def _shown(values: Array) -> Shown:
    well = values < WORSE
    kept = values[well] if well.any() else np.array([np.nan])
    return Shown(float(kept.mean()), float(kept.max()), int(np.sum(~well)))


class _Flying:
    """Flights of the scenario with other values."""

    def __init__(self, what: tuple[Any, ...], make: Callable[..., Any], told: Told) -> None:
        self._what, self._make, self._told = what, make, told
        self.count = self._missed = 0

    def fly(self, trials: Sequence[tuple[Mapping[str, float], int]]) -> Array:
        """Return the objective (n,) of values by key and a member's number, each."""
        found = np.full(len(trials), np.inf)
        for index, value in self._make([(_objective, (*self._what, *trial)) for trial in trials]):
            found[index] = value
            self.count += 1
            self._missed += value >= WORSE
            self._told(self.count, self._missed)
        return found


def _objective(
    argument: tuple[Campaign, dict[str, Any], Goal, Mapping[str, float], int],
) -> float:
    """Return the objective of a flight; ``WORSE`` and more where it misses a requirement."""
    campaign, identity, goal, values, number = argument
    members = same(campaign, identity, alike=True)
    changed = members.with_values({path_of(key): value for key, value in values.items()})
    metrics = members.scenario.metrics
    changed.table["checks"] = goal.checks(metrics)  # type: ignore[index]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            assembly, _ = changed.member(number)
            judges, trouble = judged(assembly, first_start(assembly, [number]), [number])
    except FlightError:
        return 10.0 * WORSE
    if trouble:
        return 10.0 * WORSE
    (judge,) = judges
    required = judge.verdicts()
    if goal.is_one_of(metrics):
        value = next(m.value for m in judge.metrics() if m.metric.name == goal.minimized)
    else:
        value = required.pop(0).measured
    margin = robustness.of_flight(required) if required else 0.0
    if math.isnan(value) or margin < 0.0:
        return WORSE * (1.0 + min(-margin, 8.0))
    return value


def write(campaign: Campaign, values: Mapping[str, float], folder: Path) -> Path:
    """Write the scenario with the values that tuning found, and the user's files, into ``folder``.

    Raises:
        OSError: a file cannot be written.
    """
    members = population(campaign, alike=True)
    changed = members.with_values({path_of(key): value for key, value in values.items()})
    scenario = validated(dict(changed.table), str(members.path), members.origins)
    assembly = assemble(scenario, members.path.parent, trust=campaign.trust)
    return write_scenario(assembly, folder)


def _number(text: str) -> tuple[float, str]:
    """Return a number and its unit, "" without one; both SI."""
    try:
        return float(text), ""
    except ValueError:
        found = to_si(text, None)
        return float(found), getattr(found, "unit", "")
