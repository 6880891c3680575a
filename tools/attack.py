"""Thousands of attacks on the testbed, made from a seed: scenarios, options, logs, kills.

    python tools/attack.py logs --cases 10000 --seed 1

Each finding is printed with the name of its case. Exit status: 1 if there is one, else 0.
"""

import signal
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from rich.progress import track

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests/fuzz")]

from outcomes import Commands  # noqa: E402 - which lies there

KEEP = ROOT / "build/attack"
"""Where cases with a finding are kept."""
BATCH = 10
"""Cases from one progress report to the next."""
SHORT = {"contraction-ideal": ["duration=0.05", "checks=[]"]}
"""A flight that makes a good log, by scenario with overrides."""

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
        (log,) = _flown(SHORT, Path(folder)).values()
        _attacked("options", _options, cases, seed, jobs, log)


@app.command()
def logs(cases: Cases = 10000, seed: Seed = 0, jobs: Jobs = 2, every: Every = False) -> None:
    """Hand damaged, foreign and hostile logs to the commands that read one."""
    from logs import BASES

    with tempfile.TemporaryDirectory() as folder:
        _attacked("logs", _logs, cases, seed, jobs, _flown(BASES, Path(folder)), every)


@app.command()
def kills(cases: Cases = 1000, seed: Seed = 0, jobs: Jobs = 2) -> None:
    """Send flights a signal at a random instant, and look at what their logs have lost."""
    import kills

    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # a shell's & and nohup let them be ignored
    _warm_up()
    found = []
    bad = 0
    with ProcessPoolExecutor(jobs, get_context("fork")) as pool:
        names, chosen = zip(*islice(kills.cases(seed), cases), strict=True)
        attempts = zip(names, pool.map(kills.attempt, chosen), strict=True)
        for name, each in track(attempts, f"kills, seed {seed}", cases):
            found.append(each)
            if each.trouble:
                bad += 1
                print(f"{name}: {each.trouble}", flush=True)
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
    _warm_up()
    began, found = time.monotonic(), Findings()
    batches = [min(BATCH, cases - first) for first in range(0, cases, BATCH)]
    with ProcessPoolExecutor(jobs, get_context("fork")) as pool:
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


def _warm_up() -> None:
    """Import and compile here, once, what every command would in its fork of this process."""
    import mjspace.cli.flights
    import mjspace.cli.pictures
    import mjspace.cli.recovery
    import mjspace.cli.scenarios
    import mjspace.rendering.render  # noqa: F401
    from mjspace.plotting.page import plot
    from mjspace.runner.replay import verify
    from mjspace.scenario.files import scenario_names
    from mjspace.scenario.loading import load
    from mjspace.simulation.assembly import assemble
    from mjspace.simulation.loop import what_is_compiled

    with warnings.catch_warnings(action="ignore"), tempfile.TemporaryDirectory() as folder:
        for name in scenario_names():
            what_is_compiled(assemble(*load(name)))
        (log,) = _flown(SHORT, Path(folder)).values()
        verify(log)
        plot(log, log.with_suffix(".png"))


def _scenarios(seed: str, count: int) -> Findings:
    from scenarios import attack, cases

    found = Findings()
    with Commands() as commands:
        for name, text in islice(cases(seed), count):
            some = partial(attack, name, text, commands=commands)
            found += _faults(some, name, KEEP / f"{name}.toml", text)
    return found


def _options(seed: str, count: int, log: Path) -> Findings:
    from options import attack, cases

    found = Findings()
    with Commands() as commands:
        for name, given in islice(cases(seed), count):
            some = partial(attack, given, log, commands=commands)
            found += _faults(some, name, KEEP / f"{name}.txt", repr(given).encode())
    return found


def _logs(seed: str, count: int, bases: dict[str, Path], every: bool) -> Findings:
    from log_attack import attack
    from logs import cases

    found = Findings()
    with Commands() as commands:
        for case in islice(cases(bases, seed), count):
            name = f"{seed}-{case.name}"
            some = partial(attack, case, commands=commands, every=every)
            found += _faults(some, name, KEEP / f"{name}.mcap", case.content)
    return found


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
