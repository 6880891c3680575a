"""The loop: one control period, repeated, for one vehicle or many, in blocks of logged rows."""

import time as clock
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import SimulationError

from mjspace.contract import DesiredMotion
from mjspace.errors import FlightError
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.events import with_declared_events
from mjspace.simulation.flown_law import FlownLaw
from mjspace.simulation.initial_state import Start, last_period
from mjspace.simulation.recording import Block, Recording, until_trouble
from mjspace.simulation.stepper import Stepper
from mjspace.simulation.user_code import reference_at

BLOCK_PERIODS = 500
BLOCK_BYTES = 8_000_000  # of many vehicles: what has been recorded should still be in the cache
BLOCK_SECONDS = 0.25  # of wall time: a kill may cost three blocks, and should not cost a second


def fly(
    assembly: Assembly,
    start: Start,
    members: Sequence[int] = (0,),
    *,
    threads: int = 1,
    stop: Callable[[], bool] = lambda: False,
) -> Iterator[Block]:
    """Fly the scenario from ``start`` to its end and yield what happened, block by block.

    A row holds the state at its time, and the measurement, reference and command of that instant;
    the last row's command is not flown. ``stop`` is called each period, and True ends the flight.

    Raises:
        FlightError: the flight cannot go on; every good period has been yielded before.
        InputError: an event of the scenario names no signal of this flight; nothing was yielded.
    """
    flight = _Flight(assembly, start, members, threads)
    last = last_period(assembly.scenario)
    saturated = np.zeros((len(members), len(assembly.vehicle.motors)), dtype=bool)
    declared = assembly.scenario.events
    inside = np.zeros((len(members), len(declared)), dtype=bool)
    period = start.period
    while period <= last:
        recording, trouble = flight.record(period, last, stop)
        if trouble is not None and not len(recording):
            raise trouble
        block = recording.block(assembly, flight.stepper.layout, flight.stepper.effects, saturated)
        block, problem = until_trouble(block, flight.stepper.layout)
        if len(block.time):
            block, inside = with_declared_events(block, declared, inside)
            yield block
        if problem:
            raise FlightError(problem)
        if trouble is not None:
            raise trouble
        if stop():
            return
        saturated = recording.periods[-1].saturated.astype(bool)
        period += len(recording)


class _Flight:
    """The law and the vehicles that it flies."""

    def __init__(
        self, assembly: Assembly, start: Start, members: Sequence[int], threads: int
    ) -> None:
        self._assembly, self._control = assembly, assembly.scenario.rates.control
        self._law = FlownLaw(assembly.law, start.law, len(members))
        inner = self._law.inner if assembly.inner else None
        self.stepper = Stepper(assembly, start, members, threads=threads, inner=inner)
        # Each period, with law, signals and measurement.
        recorded = 4 * self.stepper.batch.state.nbytes
        self._periods = max(1, min(BLOCK_PERIODS, BLOCK_BYTES // recorded))

    def record(
        self, first: int, last: int, stop: Callable[[], bool]
    ) -> tuple[Recording, FlightError | None]:
        """Fly a block of periods; return its recording, and why it cannot go on, if it cannot."""
        control = self._control
        end = min(first + self._periods - 1, last)
        times = np.arange(first, end + 1, dtype=float) * control
        desired = reference_at(self._assembly.reference, times)
        recording = Recording(first, desired)
        due = clock.monotonic() + BLOCK_SECONDS
        now = first * control
        try:
            # A law's infinities are found in what it commands, not in NumPy's warnings.
            with np.errstate(all="ignore"):
                rows: Any = zip(*desired, strict=True)
                for number, row in enumerate(rows, first):
                    now, reference = number * control, type(desired)(*row)
                    self._fly_period(recording, number, reference, flown=number < last)
                    if stop() or clock.monotonic() > due:
                        break
        except (SimulationError, FlightError) as error:
            trouble = FlightError(f"stopped at t = {now:.6g} s: {error}")
            trouble.__cause__ = error.__cause__ or error
            return recording, trouble
        raised = np.flatnonzero(self.stepper.batch.warning[:, :, 1].any(axis=0))
        if len(raised):
            warning = mujoco.mjtWarning(int(raised[0])).name
            return recording, FlightError(
                f"MuJoCo warned ({warning}) between t = {first * control:.6g} s and now"
            )
        return recording, None

    def _fly_period(
        self, recording: Recording, number: int, reference: DesiredMotion, *, flown: bool
    ) -> None:
        period = self.stepper.sense(number)
        period.law, period.command, period.signals = self._law.step(
            period.time, period.measurement, reference
        )
        self.stepper.begin(period, flown=flown)
        recording.periods.append(period)
        if flown:
            self.stepper.finish(period)
