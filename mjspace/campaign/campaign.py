"""A campaign from scenario to answer: fly what has not been flown yet, on all cores."""

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mjspace.campaign.alike import may_be_alike
from mjspace.campaign.flights import Call, fly_members, log_of
from mjspace.campaign.members import Campaign, population
from mjspace.campaign.sensitivity import SAMPLING, refuse_unfit
from mjspace.campaign.store import Store
from mjspace.errors import InputError
from mjspace.interrupts import on_signals
from mjspace.runner import workers
from mjspace.runner.output import refuse_existing
from mjspace.runner.run import Progress, Result, fly_to_log, output_folder, telling_time

TOGETHER = 32
"""Members in a batch, and in a file."""
ONE_BY_ONE = 8
"""Members in a file, where they are not alike: what an interruption costs a process."""
Told = Callable[[int, int], None]
"""A function that is called with the numbers of members flown and failed so far."""


@dataclass(frozen=True)
class Flight:
    """A campaign that has been flown, or interrupted."""

    store: Store
    signal: int
    """The signal that ended it, 0 for none."""


def folder_of(campaign: Campaign, out: Path | None) -> Path:
    """Return where the campaign writes: one place for one scenario and seed, where it resumes.

    Raises:
        InputError: the scenario has a name that no folder can have.
    """
    if out is not None:
        return out
    scenario = population(campaign).scenario
    return output_folder(None, scenario.name, f"campaign-seed-{scenario.seed}")


def fly(
    campaign: Campaign,
    out: Path,
    *,
    keep: str = "failures",
    processes: int | None = None,
    block: int | None = None,
    told: Told = lambda flown, failed: None,
) -> Flight:
    """Fly the members that ``out`` does not have yet, and write them as they come.

    There are as many ``processes`` as cores, where it is left out, and ``block`` members in a
    file; neither changes any number but wall times.

    Raises:
        InputError: bad input, in one line; or another campaign is in ``out``.
        FlightError: a draw did not arrive, a member is not twice the same, or a process was killed.
        OSError: the results cannot be written.
    """
    members = population(campaign)
    if members.scenario.sampling == SAMPLING:
        refuse_unfit([each.name for each in members.dispersions], campaign.count)
    store = Store(out, members)
    with store.opened():
        done = store.finished()
        failed = len(done) - int(store.column("passed").sum())
        missing = [number for number in range(campaign.count) if number not in done]
        if block is None:
            most = TOGETHER if may_be_alike(members) else ONE_BY_ONE
            shares = 2 * (processes or os.cpu_count() or 1)
            block = max(1, min(most, math.ceil(len(missing) / shares)))
        calls = [
            (fly_members, Call(campaign, members.identity, tuple(part), keep, out))
            for part in _parts(missing, block)
        ]
        flown = len(done)
        told(flown, failed)
        if not calls:
            return Flight(store, 0)
        with on_signals() as stop:
            for _, results in workers.each(calls, stop, processes):
                store.write(results)
                flown += len(results)
                failed += sum(not one.passed for one in results)
                told(flown, failed)
        return Flight(store, stop.signal)


def fly_one(
    campaign: Campaign, out: Path, member: int, *, force: bool, progress: Progress
) -> Result:
    """Fly one member alone into a log: its ``/state`` is that of the campaign.

    Raises:
        InputError: there is no such member, or its log is there already; otherwise as
            ``runner.run.fly_to_log``.
    """
    if not 0 <= member < campaign.count:
        raise InputError(f"--member {member}: should be from 0 to {campaign.count - 1}")
    path = log_of(out, member)
    refuse_existing(path, force=force)
    assembly, _ = population(campaign).member(member)
    return fly_to_log(assembly, path, member=member, force=force, watch=telling_time(progress))


def _parts(missing: Sequence[int], size: int) -> list[list[int]]:
    """Return the members in parts of at most that size, each of consecutive ones."""
    parts: list[list[int]] = []
    for number in missing:
        if parts and len(parts[-1]) < size and parts[-1][-1] == number - 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    return parts
