"""What a campaign costs: a member's integration step over a bare one of the same model.

``python benchmarks/campaign_speed.py [WORDS]``: the rows whose name has any of the words; all, when
left out. A process flies them as each worker of ``mjspace campaign`` does, on one thread;
bare is a loop of ``Batch.step`` over as many vehicles, and untimed the same without MuJoCo's
timers, which no flight has. Processor time, in turn: others on the same
cores then count less. Times are of a step [us], core-hours of 1e6 members.
"""

import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from flights import bare_batch, steps_of
from timing import head, row

from mjspace.campaign.flights import Call, fly_members
from mjspace.campaign.members import Campaign, Population, population
from mjspace.contract import Array
from mjspace.runner.checks import Judge
from mjspace.simulation.native_batch import NativeBatch

ROUNDS = 3
BARE = 48000
"""Steps of a bare loop, of all vehicles together; there is one before and after each campaign."""
PARTS = {
    "assembled": (Population, "member"),
    "compiled": (NativeBatch, "apply"),
    "judged": (Judge, "add"),
}


class Case(NamedTuple):
    """A row of the table."""

    name: str
    scenario: str
    dispersions: str = ""
    """In place of its own."""
    members: int = 16
    """How many fly."""


def uniform(key: str, low: float, high: float) -> str:
    return f"{{key='{key}',distribution='uniform',low={low},high={high}}}"


RATE = uniform("initial.rate[0]", 0.0, 0.3)
CASES = (
    Case("contraction-adaptive; rate", "contraction-adaptive", RATE),
    Case(
        "contraction-adaptive; rate and inertia",
        "contraction-adaptive",
        f"{RATE},{uniform('plant.gyrostat_inertia[1][1]', 9.5, 10.5)}",
    ),
    Case("detumble-wheels; rate", "detumble-wheels", RATE),
    Case(
        "detumble-wheels; rate and inertia",
        "detumble-wheels",
        f"{RATE},{uniform('plant.gyrostat_inertia[1][1]', 11, 13)}",
    ),
    Case("detumble-wheels; gain, one by one", "detumble-wheels", uniform("law.rate_gain", 5, 7)),
    Case("lander; mass, one by one", "lander", uniform("plant.vehicle_mass", 95, 105), 2),
    Case("lander-dispersed, one by one", "lander-dispersed", members=2),
)


@contextmanager
def parts_timed() -> Iterator[dict[str, float]]:
    """Yield the processor time [s] of each of the ``PARTS``, added up until the end."""
    spent = dict.fromkeys(PARTS, 0.0)
    usual = {name: getattr(owner, method) for name, (owner, method) in PARTS.items()}

    def timed(name: str) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            began = time.process_time()
            try:
                return usual[name](*arguments)
            finally:
                spent[name] += time.process_time() - began

        return call

    for name, (owner, method) in PARTS.items():
        setattr(owner, method, timed(name))
    try:
        yield spent
    finally:
        for name, (owner, method) in PARTS.items():
            setattr(owner, method, usual[name])


def seconds(run: Callable[[], object]) -> float:
    """Return the processor time [s] that ``run`` takes."""
    began = time.process_time()
    run()
    return time.process_time() - began


def measured(case: Case) -> tuple[int, Array]:
    """Return the steps of a member, and (rounds, 3 + parts) times of one [us]."""
    changes = (f"dispersions=[{case.dispersions}]",) if case.dispersions else ()
    everyone = population(campaign := Campaign(case.scenario, changes, case.members, seed=1))
    vehicles = everyone.nominal, case.members, 1, BARE // case.members
    bare, untimed = bare_batch(*vehicles), bare_batch(*vehicles, timed=False)
    steps, rows = steps_of(everyone.nominal), []
    calls = [
        Call(campaign, everyone.identity, tuple(range(count)), "none", Path("unused"))
        for count in (1, case.members)
    ]
    fly_members(calls[0])  # compiles what no earlier flight has
    for _ in range(ROUNDS):
        before = np.array([seconds(bare), seconds(untimed)])
        with parts_timed() as parts:
            whole = seconds(lambda: fly_members(calls[1]))
        of_bare = (before + np.array([seconds(bare), seconds(untimed)])) / (2 * BARE)
        rows.append(
            [*of_bare, *(each / (steps * case.members) for each in (whole, *parts.values()))]
        )
    return steps, 1e6 * np.array(rows)


def main() -> None:
    """Print the table."""
    words = sys.argv[1:]
    head(
        "a campaign, one thread",
        "steps",
        "bare",
        "untimed",
        "member",
        "ratio",
        *PARTS,
        "core-hours",
    )
    for case in CASES:
        if words and not any(word in case.name for word in words):
            continue
        steps, times = measured(case)
        bare, untimed, member, *parts = np.median(times, axis=0)
        ratio = float(np.median(times[:, 2] / times[:, 0]))
        cells = [f"{value:.2f}" for value in (bare, untimed, member, ratio, *parts)]
        # Microseconds of a step, times steps, are seconds of a million members.
        row(case.name, str(steps), *cells, f"{member * steps / 3600.0:.0f}")


if __name__ == "__main__":
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        main()
