"""What the loop costs: a flight over bare steps of the same model, in one run.

``python benchmarks/closed_loop.py [WORDS]``: the rows whose name has any of the words; all, when
left out. Bare is a loop in Python of ``mj_step``, or of ``Batch.step`` for many vehicles.
"""

import subprocess
import sys
import tempfile
import warnings
from functools import partial
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
import own_law as own
from flights import Run, bare_batch, bare_steps, built, flight, logged, steps_of
from timing import head, paired, ratio, row

from mjspace.contract import Law, Measurement, Reference
from mjspace.simulation.assembly import Assembly

OWN_LAW = Path(__file__).parent / "three_wheels.toml"


class Case(NamedTuple):
    """A row of the table."""

    name: str
    scenario: str | Path
    changes: tuple[str, ...] = ()
    logged: bool = True
    aim: str = ""


SLOW = "rates.control='10 ms'"
CASES = (
    Case("contraction-adaptive, 1 kHz", "contraction-adaptive", ("duration=60",), logged=False),
    Case("contraction-adaptive, 1 kHz", "contraction-adaptive", ("duration=60",), aim="1.5"),
    Case("the same, law at 100 Hz", "contraction-adaptive", ("duration=60", SLOW), logged=False),
    Case("the same, law at 100 Hz", "contraction-adaptive", ("duration=60", SLOW), aim="1.15"),
    Case("dgvscmg-tracking, 10 kHz drives", "dgvscmg-tracking", ("duration=5",), logged=False),
    Case("dgvscmg-tracking, 10 kHz drives", "dgvscmg-tracking", ("duration=5",), aim="1.5"),
    Case("lander, burning tank", "lander", ("duration=20",), aim="1.5"),
    Case("rcs-schmitt, thrusters", "rcs-schmitt"),
    Case("contraction-noise, a noisy gyro", "contraction-noise", ("duration=10",)),
)


def main() -> None:
    """Print the tables."""
    warnings.simplefilter("ignore")
    words = sys.argv[1:]

    def wanted(name: str) -> bool:
        return not words or any(word in name for word in words)

    head("one vehicle", "logged", "us a step", "bare", "ratio", "aim")
    for case in CASES:
        if wanted(case.name):
            vehicle = built(case.scenario, *case.changes)
            steps = steps_of(vehicle)
            run = logged(vehicle) if case.logged else flight(vehicle)
            report((case.name, "yes" if case.logged else "no"), run, vehicle, steps, case.aim)
    if wanted("mjspace run"):
        command_line("contraction-adaptive", 60)
    if wanted("own law"):
        print()
        own_law()
    if wanted("256 vehicles"):
        print()
        many()


def report(names: tuple[str, str], run: Run, vehicle: Assembly, steps: int, aim: str) -> None:
    """Print how much longer ``run`` takes than bare steps, and both for a step."""
    times = paired(run, bare_steps(vehicle, steps))
    each = 1e6 * times.min(axis=0) / steps
    row(*names, f"{each[0]:.1f}", f"{each[1]:.1f}", f"{ratio(times):.2f}", aim)


def command_line(scenario: str, duration: int) -> None:
    """Print the same for ``mjspace run`` as a process: start, flight, log and checks."""
    vehicle = built(scenario, f"duration={duration}")
    command = [sys.executable, "-m", "mjspace", "run", scenario, "--duration", str(duration)]
    name = f"`mjspace run`, {duration} s of the first, start included"
    with tempfile.TemporaryDirectory() as folder:
        run = partial(subprocess.run, [*command, "--force", "--out", folder], capture_output=True)
        report((name, "yes"), run, vehicle, steps_of(vehicle), "")


def own_law() -> None:
    """Print what a law of one's own costs, and what is left of it without the law's own time."""
    head("a law of one's own, 1 kHz, logged", "us a step", "law", "bare", "ratio", "rest", "aim")
    cases = (("20 lines of NumPy", own.Feedback), ("with a branch", own.Branching))
    for name, law in cases:
        vehicle = built(OWN_LAW, "duration=20", f"law.kind=own_law.py:{law.__name__}")
        steps = steps_of(vehicle)
        times = paired(logged(vehicle), calls(law(), steps), bare_steps(vehicle, steps))
        rest = median((times[:, 0] - times[:, 1]) / times[:, 2])
        each = 1e6 * times.min(axis=0) / steps
        figures = (*(f"{us:.1f}" for us in each), f"{ratio(times):.2f}", f"{rest:.2f}")
        row(name, *figures, "1.6" if law is own.Branching else "")


def calls(law: Law, count: int) -> Run:
    """Return a loop in Python of the law's ``step``, of a vehicle that turns."""
    measurement = Measurement(
        attitude=np.array([0.6, 0.48, -0.48, 0.424]), rate=np.array([0.05, -0.03, 0.04])
    )
    reference = Reference(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))

    def run() -> None:
        for _ in range(count):
            law.step(None, 0.0, measurement, reference)

    return run


def many() -> None:
    """Print what a batch costs a step, beyond its set-up, and what that takes.

    The set-up is what a flight of two periods takes: batches, sensors, and the trace of the law.
    """
    head("256 vehicles, 1 kHz, not logged", "us a step", "bare", "ratio", "aim", "set-up [ms]")
    vehicle, short = (built("contraction-adaptive", f"duration={s}") for s in (1, 0.002))
    steps = steps_of(vehicle)
    for threads, aim in ((1, "1.08"), (2, "1.08")):
        runs = flight(vehicle, 256, threads), flight(short, 256, threads)
        times = paired(*runs, bare_batch(vehicle, 256, threads, steps))
        times[:, 0] -= times[:, 1]
        setup, each = 1e3 * np.median(times[:, 1]), 1e6 * times.min(axis=0) / (256 * steps)
        row(
            f"{threads} thread{'s' * (threads > 1)}",
            *(f"{us:.1f}" for us in each[[0, 2]]),
            f"{ratio(times):.2f}",
            aim,
            f"{setup:.0f}",
        )


if __name__ == "__main__":
    main()
