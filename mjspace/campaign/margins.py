"""Margins of a law: how much worse a scenario may become in each way before it fails."""

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

from mjspace.campaign.flights import judged_alone
from mjspace.campaign.perturbations import KINDS, Nominal
from mjspace.campaign.requirement import requirement
from mjspace.errors import FlightError, InputError, nearest
from mjspace.interrupts import Interrupted, on_signals
from mjspace.runner import workers
from mjspace.scenario.loading import read, validated
from mjspace.simulation.assembly import Assembly, assemble

Told = Callable[[int, int], None]
"""A function that is called with how many of all margins are found."""


@dataclass(frozen=True)
class Question:
    """Whose margins are sought, and what has to hold."""

    scenario: str
    """Its name or path."""
    overrides: tuple[str, ...] = ()
    """As ``--set`` takes them."""
    requirements: tuple[str, ...] = ()
    """As ``requirement`` reads them; the scenario's own checks where there is none."""
    tolerance: float = 0.05
    """Of a margin, relative."""
    trust: bool = False


@dataclass(frozen=True)
class Trial:
    """One flight."""

    step: float
    value: float
    survived: bool
    why: str
    """What failed, or why it could not be flown; empty where it survived."""


@dataclass(frozen=True)
class Margin:
    """How much of one perturbation a scenario survives."""

    key: str
    """In ``KINDS``."""
    trials: list[Trial] = field(default_factory=list)
    """In the order in which they were flown."""

    @property
    def name(self) -> str:
        """As a person reads it."""
        return KINDS[self.key].name

    @property
    def unit(self) -> str:
        """SI, or "" for a factor."""
        return KINDS[self.key].unit

    @property
    def survived(self) -> float | None:
        """The worst value that was flown well; None: not even the first."""
        well = [trial for trial in self.trials if trial.survived]
        return max(well, key=lambda trial: trial.step).value if well else None

    @property
    def failed(self) -> Trial | None:
        """The flight with the least of it that failed; None: none did."""
        badly = [trial for trial in self.trials if not trial.survived]
        return min(badly, key=lambda trial: trial.step, default=None)


def nominal_of(question: Question) -> Nominal:
    """Return the scenario with what is required, unperturbed; it is not flown.

    Raises:
        InputError: bad input, in one line.
    """
    table, path, origins = read(question.scenario, question.overrides)
    table.pop("dispersions", None)
    if question.requirements:
        checks = [requirement(text) for text in question.requirements]
        table["checks"] = [check.model_dump(exclude_defaults=True) for check in checks]
    scenario = validated(table, str(path), origins)
    if not scenario.checks:
        raise InputError(f"{path}: no checks: say what has to hold by --require")
    assembly = assemble(scenario, path.parent, trust=question.trust)
    return Nominal(table, path, question.trust, assembly)


def find(
    question: Question,
    keys: Sequence[str] = (),
    *,
    processes: int | None = None,
    told: Told = lambda found, failed: None,
) -> list[Margin]:
    """Return the margins, those of ``keys`` or all that apply to the scenario.

    Raises:
        InputError: bad input, in one line; or the scenario fails as it is.
        FlightError: a process was killed.
        Interrupted: a signal ended it.
    """
    for key in keys:
        if key not in KINDS:
            raise InputError(f"--only {key}: no such perturbation{nearest(key, KINDS)}")
    nominal = nominal_of(question)
    chosen = [key for key in keys or KINDS if KINDS[key].applies(nominal)]
    if lacking := [key for key in keys if key not in chosen]:
        raise InputError(f"--only {lacking[0]}: {question.scenario} has nothing that it changes")
    if why := _failure(nominal.assembly):
        raise InputError(f"{question.scenario}: fails as it is: {why}")
    found: dict[int, Margin] = {}
    told(0, 0)
    with on_signals() as stop:
        calls = [(_margin, (question, key)) for key in chosen]
        for index, margin in workers.each(calls, stop, processes):
            found[index] = margin
            told(len(found), 0)
        if stop():  # a margin that was broken off is none
            raise Interrupted(stop.signal)
    return [found[index] for index in sorted(found)]


def _margin(argument: tuple[Question, str]) -> Margin:
    """Search one margin: doubled until a flight fails, then bisected."""
    question, key = argument
    nominal, kind, margin = _nominal(question), KINDS[key], Margin(key)

    def survives(step: float) -> bool:
        why = _trouble(nominal, kind.change(nominal, step))
        margin.trials.append(Trial(step, kind.value(nominal, step), not why, why))
        return not why

    low, high = 0.0, kind.first
    while survives(high):
        if high >= kind.most:
            return margin
        low, high = high, min(2.0 * high, kind.most)
    while low and not _close(low, high, question.tolerance, whole=kind.whole):
        middle = math.sqrt(low * high)
        middle = float(min(max(round(middle), low + 1), high - 1)) if kind.whole else middle
        low, high = (middle, high) if survives(middle) else (low, middle)
    return margin


def _close(low: float, high: float, tolerance: float, *, whole: bool) -> bool:
    return high - low <= max(tolerance * low, 1.0 if whole else 0.0)


@lru_cache(maxsize=1)
def _nominal(question: Question) -> Nominal:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # shown where the search began
        return nominal_of(question)


def _trouble(nominal: Nominal, table: dict[str, object]) -> str:
    """Return what fails in a flight of the scenario's ``table``; empty if nothing does."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            scenario = validated(table, str(nominal.path))
            return _failure(assemble(scenario, nominal.path.parent, trust=nominal.trust))
    except (InputError, FlightError) as error:
        return f"could not be flown: {error}"


def _failure(assembly: Assembly) -> str:
    """Return what fails in a flight; empty if nothing does.

    Raises:
        InputError: a check is of a signal that there is not.
        FlightError: it cannot begin.
    """
    verdicts, trouble = judged_alone(assembly)
    failed = next((each for each in verdicts if not each.as_expected), None)
    if failed is None or trouble:
        return trouble
    return f"{failed.check.name}: {failed.missing or format(failed.measured, '.4g')}"
