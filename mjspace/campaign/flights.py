"""Flying some members of a campaign, side by side where they are alike."""

import json
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from mjspace.campaign.alike import alike, start_of
from mjspace.campaign.members import Campaign, Population, population
from mjspace.campaign.places import is_remote, write_whole
from mjspace.errors import FlightError, InputError
from mjspace.interrupts import Interrupted
from mjspace.runner import scratch
from mjspace.runner.checks import Judge, Verdict
from mjspace.runner.metrics import Measured
from mjspace.runner.output import LOG
from mjspace.runner.run import fly_to_log, refuse_unjudgeable
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.initial_state import Start, first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import one_vehicle, shapes


@dataclass(frozen=True)
class Flown:
    """What one member drew, and how it went."""

    member: int
    draws: list[Any]
    verdicts: list[Verdict]
    metrics: list[Measured]
    trouble: str
    """Why it ended early; empty for a flight that reached its end."""
    seconds: float
    """Of wall time; of a batch its share."""

    @property
    def passed(self) -> bool:
        """Whether it reached its end and every check came out as expected."""
        return not self.trouble and all(verdict.as_expected for verdict in self.verdicts)


@dataclass(frozen=True)
class Call:
    """Members that a worker process flies."""

    campaign: Campaign
    identity: dict[str, Any]
    members: tuple[int, ...]
    keep: str
    out: Path


@dataclass(frozen=True)
class _Member:
    """A member that is to fly."""

    number: int
    assembly: Assembly
    draws: list[Any]
    seconds: float
    """Of wall time, to assemble it."""

    @classmethod
    def of(cls, members: Population, number: int) -> "_Member":
        began = time.perf_counter()
        assembly, draws = members.member(number)
        return cls(number, assembly, draws, time.perf_counter() - began)


def log_of(out: Path, member: int) -> Path:
    """Return where the member's log is in the folder of its campaign."""
    return out / "logs" / f"{member:06d}" / LOG


def fly_members(call: Call) -> list[Flown]:
    """Fly the members, and keep the logs that are to be kept.

    Raises:
        InputError: the scenario does not admit what a member drew, or its files have changed.
        FlightError: a draw did not arrive in the flight; or a member alone is not as in a batch.
        OSError: a log cannot be written.
    """
    members = same(call.campaign, call.identity)
    flown = fly_numbers(members, call.members)
    for one in flown:
        if keeps(call.keep, one):
            keep_log(members, one, log_of(call.out, one.member))
    return flown


def fly_numbers(members: Population, numbers: Sequence[int]) -> list[Flown]:
    """Fly the members of these numbers; no log is written.

    Raises:
        InputError: the scenario does not admit what a member drew.
        FlightError: a draw did not arrive in the flight.
    """
    flown: list[Flown] = []
    group: list[_Member] = []
    for number in numbers:
        member = _Member.of(members, number)
        if group and not alike(group[0].assembly, member.assembly):
            flown += _side_by_side(group)
            group = []
        group.append(member)
    return flown + _side_by_side(group)


def keeps(keep: str, one: Flown) -> bool:
    """Return whether the log of a member is kept: of ``failures``, of ``all`` or of ``none``."""
    return keep == "all" or (keep == "failures" and not one.passed)


def same(campaign: Campaign, identity: Mapping[str, Any], *, alike: bool = False) -> Population:
    """Return the members, once for the calls of a process, if they are those that began.

    Raises:
        InputError: the files have changed since.
    """
    return _same(campaign, json.dumps(identity), alike)


@lru_cache(maxsize=1)
def _same(campaign: Campaign, identity: str, alike: bool) -> Population:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # shown where the campaign began
        members = population(campaign, alike=alike)
    if json.dumps(members.identity) != identity:
        raise InputError(f"{members.path}: the scenario, or its law, changed during the campaign")
    return members


def _side_by_side(group: Sequence[_Member]) -> list[Flown]:
    """Fly members that are ``alike``; where one has to end early, again in two halves."""
    began = time.perf_counter()
    first, numbers = group[0].assembly, [each.number for each in group]
    start = start_of([each.assembly for each in group], numbers)
    judges, trouble = judged(first, start, numbers)
    if trouble and len(group) > 1:
        half = len(group) // 2
        return _side_by_side(group[:half]) + _side_by_side(group[half:])
    share = (time.perf_counter() - began) / len(group)
    shown = [(judge.verdicts(), judge.metrics()) for judge in judges] or [([], [])] * len(group)
    return [
        Flown(each.number, each.draws, *found, trouble, each.seconds + share)
        for each, found in zip(group, shown, strict=True)
    ]


def judged_alone(assembly: Assembly, member: int = 0) -> tuple[list[Verdict], str]:
    """Fly one member from its start and return its verdicts, and why the flight ended early.

    Raises:
        InputError: a check names no signal of the flight.
        FlightError: it cannot begin.
    """
    judges, trouble = judged(assembly, first_start(assembly, [member]), [member])
    return [verdict for judge in judges for verdict in judge.verdicts()], trouble


def judged(assembly: Assembly, start: Start, members: Sequence[int]) -> tuple[list[Judge], str]:
    """Fly the members and return the judge of each, and why the flight ended early.

    There is none where it ended before the first block.

    Raises:
        InputError: a check names no signal of the flight.
    """
    judges: list[Judge] = []
    trouble = ""
    scenario = assembly.scenario
    try:
        for block in fly(assembly, start, members):
            if not judges:
                refuse_unjudgeable(assembly, block)
                topics = shapes(block)
                metrics = scenario.metrics, assembly.metrics
                what = scenario.checks, scenario.events, topics, *metrics, scenario.rates.control
                judges = [Judge(*what) for _ in members]
            for vehicle, judge in enumerate(judges):
                judge.add(block.time, one_vehicle(block, vehicle))
    except FlightError as error:
        trouble = str(error)
    return judges, trouble


def keep_log(members: Population, flown: Flown, path: Path) -> None:
    """Fly a member once more, into a log, and see that it is as it was.

    Raises:
        FlightError: it is not.
        OSError: the log cannot be written.
    """
    if is_remote(path):
        with scratch.folder() as folder:
            keep_log(members, flown, log := folder / LOG)
            if log.is_file():
                write_whole(path, log.read_bytes())
        return
    assembly, _ = members.member(flown.member)
    try:
        result = fly_to_log(assembly, path, member=flown.member, force=True)
    except FlightError:  # it could not even begin, and there is nothing to log
        return
    if result.signal:
        path.unlink()
        raise Interrupted(result.signal)
    lines = [[verdict.line for verdict in each.verdicts] for each in (result, flown)]
    if lines[0] != lines[1] or result.trouble != flown.trouble:
        raise FlightError(
            f"member {flown.member} is not twice the same: {result.trouble or lines[0]}, and "
            f"before {flown.trouble or lines[1]}: has its law a memory of its own?"
        )
