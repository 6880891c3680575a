"""Falsification: the flight with the least margin within a scenario's dispersions, made minimal."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from mjspace.campaign import draws, robustness
from mjspace.campaign.flights import judged_alone, same
from mjspace.campaign.members import Campaign, Population
from mjspace.campaign.search import minimize
from mjspace.campaign.written import write_scenario
from mjspace.contract import Array
from mjspace.errors import FlightError, InputError
from mjspace.interrupts import Interrupted, on_signals
from mjspace.runner import workers
from mjspace.runner.output import LOG
from mjspace.runner.run import Result, fly_to_log

EDGE = 0.00135
"""Probability that is left out at either end of what is drawn: three sigma of a normal one."""
HALVINGS = 6
"""Of the distance to the scenario's own value, of each number that is made smaller."""
Told = Callable[[int, int], None]
"""A function that is called with how many flights there were, and how many failed."""


@dataclass(frozen=True)
class Candidate:
    """A flight that was tried."""

    draws: list[Any]
    """Of each dispersion, in SI."""
    margin: float
    """The least relative margin of its checks; negative where it fails."""
    why: str
    """What is worst in it."""


@dataclass(frozen=True)
class Falsified:
    """What a search found."""

    worst: Candidate
    minimal: Candidate | None
    """The worst, with as few and as small departures from the scenario's own values as still fail;
    None where nothing failed."""
    flights: int
    """In all."""
    before: int
    """Until the first that failed, that one included; 0 where none did."""
    signal: int = 0
    """That ended it early."""


def falsify(
    members: Population,
    *,
    go_on: bool = False,
    processes: int | None = None,
    told: Told = lambda flown, failed: None,
) -> Falsified:
    """Search for the flight with the least margin, in at most as many flights as ``members``.

    It ends with the first generation in which one fails, unless it is to ``go_on``, and makes the
    worst minimal. What is drawn keeps within three sigma.

    Raises:
        InputError: bad input, in one line; or the scenario fails as it is.
        FlightError: a process was killed.
        Interrupted: a signal ended it before anything was flown.
    """
    campaign = members.campaign
    if not members.dispersions:
        raise InputError(f"{members.path}: dispersions: none, there is nothing to search")
    if not members.scenario.checks:
        raise InputError(f"{members.path}: no checks: write in [[checks]] what has to hold")
    own = nominal_draws(members)
    module = __name__
    with on_signals() as stop, workers.team(module, stop, processes) as make:
        search = _Search(campaign, members, make, told)
        flown = search.fly([own])
        if not flown:
            raise Interrupted(stop.signal)
        if flown[0].margin < 0.0:
            raise InputError(f"{members.path}: fails as it is: {flown[0].why}")
        width = draws.width_of(members.dispersions)
        for _ in minimize(search.values, width, campaign.count, members.scenario.seed):
            if stop() or (search.failed and not go_on):
                break
        worst = min(search.flown, key=lambda one: one.margin)
        before = search.before
        minimal = search.smaller(worst, own, stop) if worst.margin < 0.0 else None
    return Falsified(worst, minimal, len(search.flown), before, stop.signal)


def nominal_draws(members: Population) -> list[Any]:
    """Return the scenario's own value of each dispersion; the median draw where it has none."""
    middle = np.full(draws.width_of(members.dispersions), 0.5)
    medians = draws.values(members.dispersions, members.own_values, middle)
    return [m if own is None else own for own, m in zip(members.own_values, medians, strict=True)]


class _Search:
    """The flights of a search, in the order in which they were flown."""

    def __init__(
        self, campaign: Campaign, members: Population, make: Callable[..., Any], told: Told
    ) -> None:
        self._call = (campaign, members.identity)
        self._members, self._make, self._told = members, make, told
        self.flown: list[Candidate] = []
        self.failed = self.before = 0

    def values(self, points: Array) -> Array:
        """Return the margins (n,) of points (n, width) in the unit box."""
        rows = EDGE + (1.0 - 2.0 * EDGE) * points
        chosen = [
            draws.values(self._members.dispersions, self._members.own_values, row) for row in rows
        ]
        return np.array([one.margin for one in self.fly(chosen)])

    def fly(self, chosen: Sequence[list[Any]]) -> list[Candidate]:
        """Fly the scenario with each of the draws."""
        calls = [(_fly, (*self._call, each)) for each in chosen]
        found = {}
        for index, (margin, why) in self._make(calls):
            found[index] = Candidate(chosen[index], margin, why)
            self.failed += margin < 0.0
            self._told(len(self.flown) + len(found), self.failed)
        flown = [found[index] for index in sorted(found)]
        for number, one in enumerate(flown, len(self.flown) + 1):
            if one.margin < 0.0 and not self.before:
                self.before = number
        self.flown += flown
        return flown

    def smaller(self, worst: Candidate, own: list[Any], stop: Callable[[], bool]) -> Candidate:
        """Return the candidate with fewest and smallest departures from ``own`` that still fails.

        Each is undone in turn where the flight fails without it, and what is left is halved.
        """
        kept = worst
        for place in range(len(own)):
            if not stop():
                kept = self._with(kept, place, own[place])
        for place, value in enumerate(own):
            if not isinstance(value, int | float) or kept.draws[place] == value:
                continue
            far, near = 1.0, 0.0  # of the way from its own value to what was found
            whole = kept.draws[place] - value
            for _ in range(HALVINGS):
                if stop():
                    break
                middle = 0.5 * (far + near)
                after = self._with(kept, place, value + middle * whole)
                far, near = (middle, near) if after is not kept else (far, middle)
                kept = after
        return kept

    def _with(self, kept: Candidate, place: int, value: Any) -> Candidate:
        """Return the candidate with another value where that still fails, else itself."""
        if kept.draws[place] == value:
            return kept
        changed = [*kept.draws[:place], value, *kept.draws[place + 1 :]]
        found = self.fly([changed])
        return found[0] if found and found[0].margin < 0.0 else kept


def _fly(argument: tuple[Campaign, dict[str, Any], list[Any]]) -> tuple[float, str]:
    """Return the least margin of a flight with these draws, and what is worst in it."""
    campaign, identity, chosen = argument
    members = same(campaign, identity)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            assembly = members.built(chosen, "a flight of the search")
            verdicts, trouble = judged_alone(assembly)
    except FlightError as error:
        return -inf, str(error)
    if trouble:
        return -inf, trouble
    margins = [robustness.of_flight([verdict]) for verdict in verdicts]
    least = min(margins)
    return least, verdicts[margins.index(least)].line


def write(members: Population, found: Candidate, folder: Path) -> Result:
    """Fly a candidate into a log in ``folder``, and write its scenario with the user's files there.

    Raises:
        InputError: there is a log already.
        OSError: a file cannot be written.
    """
    assembly = members.built(found.draws, "the counterexample")
    result = fly_to_log(assembly, folder / LOG)
    write_scenario(assembly, folder)
    return result
