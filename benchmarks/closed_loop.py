"""What the loop costs: a flight over bare ``mj_step`` of the same model, in one run.

Each figure is the median of the ratios of neighbouring runs, so that a machine that slows down or
speeds up meanwhile changes both sides. ``python benchmarks/closed_loop.py``
"""

import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from statistics import median

import mujoco
import numpy as np
from mujoco.batch import Batch

from mjspace.runner.run import fly_to_log
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

ROUNDS = 5


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore")
    print(f"{'':52}{'ratio':>8}{'us a step':>12}")
    steps = 30_000
    for control in ("1 ms", "10 ms"):
        vehicle = built(f"duration={steps * 1e-3}", f"rates.control='{control}'")
        bare = bare_steps(vehicle, steps)
        report(f"one vehicle, control {control}, not logged", flight(vehicle), bare, steps)
        report(f"one vehicle, control {control}, all logged", logged(vehicle), bare, steps)
    vehicle, steps = built("duration=0.5"), 500
    for threads in (1, 2):
        bare = bare_batch(vehicle, 256, threads, steps)
        flown = flight(vehicle, 256, threads)
        report(f"256 vehicles, control 1 ms, {threads} threads", flown, bare, 256 * steps)


def report(name: str, run: Callable[[], object], bare: Callable[[], object], steps: int) -> None:
    """Print how much longer ``run`` takes than ``bare``, and its time for each of its steps."""
    run(), bare()
    pairs = [(seconds(run), seconds(bare)) for _ in range(ROUNDS)]
    ratio = median(a / b for a, b in pairs)
    print(f"{name:52}{ratio:8.2f}{min(a for a, _ in pairs) / steps * 1e6:12.2f}")


def built(*overrides: str) -> Assembly:
    """Return contraction-adaptive, without checks."""
    return assemble(*load("contraction-adaptive", ["checks=[]", *overrides]))


def flight(vehicle: Assembly, count: int = 1, threads: int = 1) -> Callable[[], object]:
    """Return a flight of ``count`` vehicles without a log."""
    members = range(count)
    return lambda: sum(
        len(b.time) for b in fly(vehicle, first_start(vehicle, members), members, threads=threads)
    )


def logged(vehicle: Assembly) -> Callable[[], object]:
    """Return a flight of one vehicle with everything logged."""

    def run() -> None:
        with tempfile.TemporaryDirectory() as folder:
            fly_to_log(vehicle, Path(folder) / "flight.mcap")

    return run


def bare_steps(vehicle: Assembly, steps: int) -> Callable[[], object]:
    """Return a loop of ``mj_step`` in Python."""
    model = vehicle.vehicle.model
    data = mujoco.MjData(model)
    data.qpos, data.qvel, data.userdata = vehicle.qpos, vehicle.qvel, vehicle.userdata

    def run() -> None:
        for _ in range(steps):
            mujoco.mj_step(model, data)

    return run


def bare_batch(vehicle: Assembly, count: int, threads: int, steps: int) -> Callable[[], object]:
    """Return a loop of ``Batch.step`` in Python."""
    batch = Batch(vehicle.vehicle.model, count, threads)
    batch.qpos, batch.qvel = np.tile(vehicle.qpos, (count, 1)), np.tile(vehicle.qvel, (count, 1))
    batch.userdata = np.tile(vehicle.userdata, (count, 1))

    def run() -> None:
        for _ in range(steps):
            batch.step()

    return run


def seconds(run: Callable[[], object]) -> float:
    """Return how long ``run`` takes."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
