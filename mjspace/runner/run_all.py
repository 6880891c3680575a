"""All scenarios that come with mjspace, flown on all cores, and their verdicts in one table."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from mjspace.interrupts import on_signals
from mjspace.runner import report, run, workers
from mjspace.runner.output import LOG, refuse_existing
from mjspace.runner.run import Progress
from mjspace.scenario.loading import load


@dataclass(frozen=True)
class Outcome:
    """The outcome of flying one scenario."""

    name: str
    description: str
    result: dict[str, Any]
    """As ``mjspace run --json`` prints it."""
    seconds: float
    """Of wall time."""

    @property
    def verdict(self) -> str:
        """PASS if it reached its end and every check came out as expected, else FAIL."""
        return "PASS" if self.result["passed"] else "FAIL"


def fly(
    names: Sequence[str],
    overrides: Sequence[str],
    out: Path,
    progress: Progress,
    *,
    force: bool = False,
) -> tuple[list[Outcome], int]:
    """Fly the scenarios, each into a folder of its name in ``out``.

    Return their outcomes in their order, and the signal that ended it, 0 for none: then those of
    the scenarios that had begun.

    Raises:
        InputError: an override that a scenario does not take, or a log that is there already.
        FlightError: a process that flies was killed.
        OSError: a log cannot be written.
    """
    scenarios = [load(name, overrides)[0] for name in names]
    costs = [s.duration / s.rates.physics for s in scenarios]
    longest_first = sorted(range(len(names)), key=lambda i: -costs[i])
    for name in names:
        refuse_existing(out / name / LOG, force=force)
    calls = [(_flown, (names[i], tuple(overrides), out / names[i], force)) for i in longest_first]
    outcomes, done = {}, 0.0
    with on_signals() as stop:
        for index, outcome in workers.each(calls, stop):
            place = longest_first[index]
            outcomes[place] = outcome
            done += costs[place]
            progress(done / sum(costs))
    return [outcomes[place] for place in sorted(outcomes)], stop.signal


def _flown(call: tuple[str, tuple[str, ...], Path, bool]) -> Outcome:
    name, overrides, out, force = call
    scenario, _ = load(name, overrides)
    began = time.perf_counter()
    result = report.result_data(run.run(name, overrides=overrides, out=out, force=force))
    seconds = time.perf_counter() - began
    return Outcome(name, scenario.description, result, seconds)


def data(outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Return the outcomes as ``--json`` prints them."""
    return [
        {
            "scenario": outcome.name,
            "description": outcome.description,
            "verdict": outcome.verdict,
            "seconds": round(outcome.seconds, 3),
            **outcome.result,
        }
        for outcome in outcomes
    ]


def show(outcomes: Sequence[Outcome]) -> None:
    """Print the table; under it, what is wrong with each flight that did not pass."""
    console = Console()
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("scenario", "verdict", "checks", "time", "description"):
        table.add_column(column, no_wrap=column != "description")
    for outcome in outcomes:
        checks = outcome.result["checks"]
        right = [check for check in checks if check["as_expected"]]
        failed = sum(check["verdict"] == "FAIL" for check in right)
        style = "green" if outcome.result["passed"] else "bold red"
        verdict = f"[{style}]{outcome.verdict}[/]"
        count = f"{len(right)}/{len(checks)}" + (f", {failed} FAIL as expected" if failed else "")
        spent = f"{outcome.seconds:.1f} s"
        table.add_row(outcome.name, verdict, count, spent, outcome.description)
    console.print(table)
    for outcome in outcomes:
        if outcome.result["passed"]:
            continue
        checks = outcome.result["checks"]
        wrong = [f"{c['name']}: {c['verdict']}" for c in checks if not c["as_expected"]]
        why = outcome.result["trouble"] or "; ".join(wrong)
        console.print(f"{outcome.name}: {why}", style="bold red", markup=False, highlight=False)
