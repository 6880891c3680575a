"""Flights that are timed, and the bare steps of MuJoCo that they are compared with.

Bare is MuJoCo as its Python package comes, which times its own functions; a flight stops that.
"""

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import mujoco
from mujoco.batch import Batch

from mjspace.runner.run import fly_to_log
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import INTEGRATION, first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.native_batch import stop_timers

Run = Callable[[], object]


def built(scenario: str | Path, *changes: str) -> Assembly:
    """Return the scenario's assembly, without checks."""
    return assemble(*load(scenario, ["checks=[]", *changes]))


def flight(vehicle: Assembly, count: int = 1, threads: int = 1) -> Run:
    """Return a flight of ``count`` vehicles without a log."""
    members = range(count)
    return lambda: sum(
        len(b.time) for b in fly(vehicle, first_start(vehicle, members), members, threads=threads)
    )


def logged(vehicle: Assembly) -> Run:
    """Return a flight of one vehicle with everything logged."""

    def run() -> None:
        with tempfile.TemporaryDirectory() as folder:
            fly_to_log(vehicle, Path(folder) / "flight.mcap")

    return run


@contextmanager
def timers(*, on: bool = True) -> Iterator[None]:
    """Let MuJoCo time its own functions, or not."""
    mujoco.set_mjcb_time(None)  # the clock that the package installs
    if not on:
        stop_timers()
    try:
        yield
    finally:
        stop_timers()


def bare_steps(vehicle: Assembly, steps: int) -> Run:
    """Return a loop of ``mj_step`` in Python, from where the vehicle starts."""
    model = vehicle.vehicle.model
    data, state = mujoco.MjData(model), first_start(vehicle, [0]).physics[0]

    def run() -> None:
        mujoco.mj_setState(model, data, state, INTEGRATION)
        with timers():
            for _ in range(steps):
                mujoco.mj_step(model, data)

    return run


def bare_batch(
    vehicle: Assembly, count: int, threads: int, steps: int, *, timed: bool = True
) -> Run:
    """Return a loop of ``Batch.step`` in Python, from where the vehicles start."""
    batch = Batch(vehicle.vehicle.model, count, threads)
    start = first_start(vehicle, range(count)).physics

    def run() -> None:
        batch.state[...] = start
        with timers(on=timed):
            for _ in range(steps):
                batch.step()

    return run


def steps_of(vehicle: Assembly) -> int:
    """Return how many integration steps a flight of it has."""
    return round(vehicle.scenario.duration / vehicle.scenario.rates.physics)
