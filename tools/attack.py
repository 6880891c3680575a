"""Thousands of attacks on the testbed, made from a seed: scenarios, options, logs, kills.

    python tools/attack.py logs --cases 10000 --seed 1

Each finding is printed with the name of its case. Exit status: 1 if there is one, else 0.
"""

import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from rich.progress import track

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests/fuzz")]
KEEP = ROOT / "build/attack"
"""Where cases with a finding are kept."""
BATCH = 10
"""Cases from one progress report to the next."""

Findings = list[tuple[str, str]]
"""Name of the case and what was wrong, one for each fault."""

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
Cases = Annotated[int, typer.Option(min=1, help="How many.")]
Seed = Annotated[int, typer.Option(help="What they are made from.")]
Jobs = Annotated[int, typer.Option(min=1, help="Processes that attack at once.")]
Every = Annotated[bool, typer.Option("--every", help="Every command on each case.")]


@app.callback()
def main() -> None:
    """Attack the testbed with cases made from a seed."""


@app.command()
def scenarios(cases: Cases = 10000, seed: Seed = 0, jobs: Jobs = 2) -> None:
    """Begin flights of scenarios with mistakes."""
    _attacked("scenarios", _scenarios, cases, seed, jobs)


@app.command()
def options(cases: Cases = 2000, seed: Seed = 0, jobs: Jobs = 2) -> None:
    """Give commands odd options."""
    with tempfile.TemporaryDirectory() as folder:
        short = {"contraction-ideal": ["duration=0.05", "checks=[]"]}
        (log,) = _flown(short, Path(folder)).values()
        _attacked("options", _options, cases, seed, jobs, log)


@app.command()
def logs(cases: Cases = 10000, seed: Seed = 0, jobs: Jobs = 2, every: Every = False) -> None:
    """Hand damaged, foreign and hostile logs to the commands that read one."""
    from logs import BASES

    with tempfile.TemporaryDirectory() as folder:
        _attacked("logs", _logs, cases, seed, jobs, _flown(BASES, Path(folder)), every)


@app.command()
def kills(cases: Cases = 1000, seed: Seed = 0) -> None:
    """Send flights a signal at a random instant, and look at what their logs have lost."""
    import kills

    found = []
    bad = 0
    for name, kill in track(islice(kills.cases(seed), cases), "kills", cases):
        found.append(kills.attempt(kill))
        if found[-1].trouble:
            bad += 1
            print(f"{name}: {found[-1].trouble}", flush=True)
    print(
        f"kills, seed {seed}: {cases} cases, {bad} with trouble; at most "
        f"{max(each.lost for each in found):.2f} s of wall time lost, a request answered after "
        f"{max(each.answered for each in found):.2f} s, {sum(each.verified for each in found)} "
        "periods flown again identically"
    )
    raise typer.Exit(1 if bad else 0)


def _flown(bases: dict[str, list[str]], folder: Path) -> dict[str, Path]:
    """Fly short flights to attack the logs of, by scenario with overrides."""
    from mjspace.runner.run import run

    return {name: run(name, overrides=o, out=folder / name).path for name, o in bases.items()}


def _attacked(
    what: str, some: Callable[..., Findings], cases: int, seed: int, jobs: int, *others: Any
) -> NoReturn:
    """Attack in ``jobs`` processes, report and exit; ``some`` tries the cases of one batch."""
    began, found = time.monotonic(), Findings()
    batches = [min(BATCH, cases - first) for first in range(0, cases, BATCH)]
    with ProcessPoolExecutor(jobs) as pool:
        tasks = [
            pool.submit(some, f"{seed}-{number}", count, *others)
            for number, count in enumerate(batches)
        ]
        for task in track(tasks, f"{what}, seed {seed}"):
            for name, fault in task.result():
                print(f"{name}: {fault}", flush=True)
                found.append((name, fault))
    kinds = Counter(fault.split(":")[-2 if ":" in fault else 0].strip() for _, fault in found)
    print(
        f"{what}: {cases} cases, seed {seed}, {time.monotonic() - began:.0f} s: {len(found)} "
        "findings" + "".join(f"; {kind} {count}" for kind, count in kinds.most_common(5))
    )
    raise typer.Exit(1 if found else 0)


def _scenarios(seed: str, count: int) -> Findings:
    from scenarios import attack, cases

    import mjspace.simulation.loop  # noqa: F401

    found = Findings()
    for name, text in islice(cases(seed), count):
        found += _faults(partial(attack, name, text), name, KEEP / f"{name}.toml", text)
    return found


def _options(seed: str, count: int, log: Path) -> Findings:
    from options import attack, cases

    import mjspace.plotting.page
    import mjspace.rendering.render
    import mjspace.runner.replay  # noqa: F401

    found = Findings()
    for name, given in islice(cases(seed), count):
        kept = KEEP / f"{name}.txt"
        found += _faults(partial(attack, given, log), name, kept, repr(given).encode())
    return found


def _logs(seed: str, count: int, bases: dict[str, Path], every: bool) -> Findings:
    from log_attack import attack
    from logs import cases

    import mjspace.cli
    import mjspace.rendering.render
    import mjspace.runner.report  # noqa: F401
    from mjspace.plotting.page import plot
    from mjspace.runner.replay import verify

    for base in set(bases.values()) - _warm:
        verify(base)  # what is compiled for a flight is then shared by all forks
        plot(base, base.with_suffix(".png"))
        _warm.add(base)
    found = Findings()
    for case in islice(cases(bases, seed), count):
        name = f"{seed}-{case.name}"
        kept = KEEP / f"{name}.mcap"
        found += _faults(partial(attack, case, every=every), name, kept, case.content)
    return found


_warm: set[Path] = set()


def _faults(
    attack: Callable[[Path], Iterator[str]], name: str, kept: Path, content: bytes
) -> Findings:
    """Return the findings of one case, whose content is then kept."""
    with tempfile.TemporaryDirectory() as folder:
        faults = list(attack(Path(folder)))
    if faults:
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(content)
    return [(name, fault) for fault in faults]


if __name__ == "__main__":
    app()
