"""All scenarios that come with mjspace, flown on all cores, and their verdicts in one table."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from mjspace import flight, report, workers
from mjspace.flight import Progress
from mjspace.loading import load


@dataclass(frozen=True)
class Outcome:
    """What flying one scenario came to."""

    name: str
    description: str
    wanted: str
    """PASS, or FAIL of one that shows a failure."""
    result: dict[str, Any]
    """As ``mjspace run --json`` prints it."""
    seconds: float
    """Of wall time."""

    @property
    def verdict(self) -> str:
        """PASS or FAIL."""
        return "PASS" if self.result["passed"] else "FAIL"

    @property
    def is_right(self) -> bool:
        """Whether the verdict is the one that the scenario is there for."""
        return self.verdict == self.wanted


def fly(
    names: Sequence[str], overrides: Sequence[str], out: Path, progress: Progress
) -> list[Outcome]:
    """Fly the scenarios, each into a folder of its name in ``out``; return them in their order.

    Raises:
        InputError: an override that a scenario does not take; what flies already goes on.
        OSError: a log cannot be written.
    """
    scenarios = [load(name, overrides)[0] for name in names]
    costs = [s.duration / s.rates.physics for s in scenarios]
    longest_first = sorted(range(len(names)), key=lambda i: -costs[i])
    calls = [(_flown, (names[i], tuple(overrides), out / names[i])) for i in longest_first]
    outcomes, done = {}, 0.0
    for index, outcome in workers.each(calls):
        place = longest_first[index]
        outcomes[place] = outcome
        done += costs[place]
        progress(done / sum(costs))
    return [outcomes[place] for place in range(len(names))]


def _flown(given: tuple[str, tuple[str, ...], Path]) -> Outcome:
    name, overrides, out = given
    scenario, _ = load(name, overrides)
    began = time.perf_counter()
    result = report.result_data(flight.run(name, overrides=overrides, out=out))
    seconds = time.perf_counter() - began
    return Outcome(name, scenario.description, scenario.verdict, result, seconds)


def data(outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Return the outcomes as ``--json`` prints them."""
    return [
        {
            "scenario": outcome.name,
            "description": outcome.description,
            "verdict": outcome.verdict,
            "wanted": outcome.wanted,
            "seconds": round(outcome.seconds, 3),
            **outcome.result,
        }
        for outcome in outcomes
    ]


def show(outcomes: Sequence[Outcome]) -> None:
    """Print the table; under a verdict that is not the wanted one, what failed."""
    console = Console()
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("scenario", "verdict", "checks", "time", "what it shows"):
        table.add_column(column, no_wrap=column != "what it shows")
    for outcome in outcomes:
        checks = outcome.result["checks"]
        kept = sum(check["passed"] for check in checks)
        style = "green" if outcome.is_right else "bold red"
        note = " as it should" if outcome.is_right and outcome.verdict == "FAIL" else ""
        verdict = f"[{style}]{outcome.verdict}{note}[/]"
        count, spent = f"{kept}/{len(checks)}", f"{outcome.seconds:.1f} s"
        table.add_row(outcome.name, verdict, count, spent, outcome.description)
    console.print(table)
    for outcome in outcomes:
        if outcome.is_right:
            continue
        failed = [check["name"] for check in outcome.result["checks"] if not check["passed"]]
        why = outcome.result["trouble"] or "; ".join(failed)
        console.print(f"{outcome.name}: {why}", style="bold red", markup=False, highlight=False)
