"""A campaign from scenario to answer: fly what has not been flown yet, on all cores."""

import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mjspace.campaign.alike import may_be_alike
from mjspace.campaign.distributed import Cluster
from mjspace.campaign.flights import Call, Flown, fly_members, log_of
from mjspace.campaign.members import Campaign, population
from mjspace.campaign.places import is_remote
from mjspace.campaign.sensitivity import SAMPLING, refuse_unfit
from mjspace.campaign.store import PART, Store
from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.interrupts import Stop, on_signals
from mjspace.runner import workers
from mjspace.runner.output import refuse_existing
from mjspace.runner.run import Progress, Result, fly_to_log, output_folder, telling_time

TOGETHER = 32
"""Members in a batch, and in a call."""
ONE_BY_ONE = 8
"""Members in a call, where they are not alike: what an interruption costs a process."""
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
    dask: Cluster | None = None,
    block: int | None = None,
    told: Told = lambda flown, failed: None,
) -> Flight:
    """Fly the members that ``out`` does not have yet, and write them as they come.

    There are as many ``processes`` as cores, where it is left out; or the workers of ``dask`` fly.
    A call has ``block`` members. None of this changes any number but wall times.

    Raises:
        InputError: bad input, in one line; or another campaign is in ``out``.
        FlightError: a draw did not arrive, a member is not twice the same, or a process was killed;
            of Dask, a member kills workers, or the scheduler is gone.
        OSError: the results cannot be written.
    """
    members = population(campaign)
    if members.scenario.sampling == SAMPLING:
        refuse_unfit([each.name for each in members.dispersions], campaign.count)
    store = Store(out, members)
    with store.opened(), on_signals() as stop:
        before = store.read(["passed"])
        done = np.zeros(campaign.count, dtype=bool)
        done[before["member"].to_numpy()] = True
        flown = int(done.sum())
        failed = flown - int(before["passed"].to_numpy(zero_copy_only=False).sum())
        missing = np.flatnonzero(~done).tolist()
        store.compact(_complete(done))
        if block is None:
            most = TOGETHER if may_be_alike(members) else ONE_BY_ONE
            cores = dask.cores if dask else processes or os.cpu_count() or 1
            block = max(1, min(most, math.ceil(len(missing) / (2 * max(cores, 1)))))
        parts = _parts(missing, block)
        told(flown, failed)
        if dask:
            blocks = dask.fly(members, parts, keep, out, stop)
        else:
            calls = [Call(campaign, members.identity, tuple(part), keep, out) for part in parts]
            blocks = _by_processes(calls, stop, processes)
        for results in blocks:
            store.write(results)
            done[[one.member for one in results]] = True
            part = results[0].member // PART
            if done[part * PART : (part + 1) * PART].all():
                store.compact([part])
            flown += len(results)
            failed += sum(not one.passed for one in results)
            told(flown, failed)
        return Flight(store, stop.signal)


def _by_processes(
    calls: Sequence[Call], stop: Stop, processes: int | None
) -> Iterator[list[Flown]]:
    """Yield what processes of this machine have flown of each call, as they are done."""
    if calls:
        for _, results in workers.each([(fly_members, call) for call in calls], stop, processes):
            yield results


def _complete(done: Array) -> list[int]:
    """Return the parts of which all members are ``done``."""
    return [at // PART for at in range(0, len(done), PART) if done[at : at + PART].all()]


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
    if is_remote(out):
        raise InputError(f"--member {member}: its log is written to a folder: give one by --out")
    path = log_of(out, member)
    refuse_existing(path, force=force)
    assembly, _ = population(campaign).member(member)
    return fly_to_log(assembly, path, member=member, force=force, watch=telling_time(progress))


def _parts(missing: Sequence[int], size: int) -> list[list[int]]:
    """Return the members in blocks of at most that size, each of consecutive ones of one part."""
    parts: list[list[int]] = []
    for number in missing:
        goes_on = parts and parts[-1][-1] == number - 1 and number % PART
        if goes_on and len(parts[-1]) < size:
            parts[-1].append(number)
        else:
            parts.append([number])
    return parts
