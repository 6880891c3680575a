"""The loop: control periods of one vehicle or many, flown in blocks of logged rows."""

import time as clock
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import SimulationError

from mjspace.contract import DesiredMotion
from mjspace.errors import FlightError
from mjspace.interrupts import Interrupted
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.compiled_blocks import CompiledBlocks, stopped_at
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.events import with_declared_events
from mjspace.simulation.flown_law import FlownLaw
from mjspace.simulation.initial_state import Start, first_start, last_period
from mjspace.simulation.recording import (
    EVERYTHING,
    Block,
    Columns,
    Recording,
    block_of,
    until_trouble,
)
from mjspace.simulation.stepper import Stepper
from mjspace.simulation.sunlight import ECLIPSES
from mjspace.simulation.user_code import reference_at

BLOCK_PERIODS = 2000
BLOCK_BYTES = 32_000_000  # of many vehicles, about
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
    the last row's command is not flown. ``stop`` is called each period, or each block where its
    inside is compiled, and True ends the flight.

    Raises:
        FlightError: the flight cannot go on; every good period has been yielded before.
        Interrupted: a signal broke it off; likewise.
        InputError: an event of the scenario names no signal of this flight; nothing was yielded.
    """
    flight = _Flight(assembly, start, members, threads)
    last = last_period(assembly.scenario)
    saturated = np.zeros((len(members), len(assembly.vehicle.motors)), dtype=bool)
    declared = assembly.scenario.events
    if "sun_position" in assembly.known:
        declared = [*declared, *ECLIPSES]
    inside = np.zeros((len(members), len(declared)), dtype=bool)
    period = start.period
    layout, effects = flight.stepper.layout, flight.stepper.effects
    while period <= last:
        columns, desired, trouble = flight.record(period, last, stop)
        block = block_of(period, desired, columns, assembly, layout, effects, saturated)
        block, problem = until_trouble(block, layout)
        if len(block.time):
            block, inside = with_declared_events(block, declared, inside)
            yield block
        if problem:
            raise FlightError(problem)
        if trouble is not None:
            raise trouble
        if stop():
            return
        saturated = columns.saturated[-1]
        period += len(columns)


def what_is_compiled(assembly: Assembly) -> str:
    """Return in one line what of a flight is compiled, and why the rest is not: by beginning one.

    Raises:
        FlightError: it cannot be flown.
    """
    flight = _Flight(assembly, first_start(assembly, [0]), [0], threads=1)
    first, last = 0, last_period(assembly.scenario)
    while first <= last and flight.compiled.is_to_be_seen:  # not where something happens
        columns, _, trouble = flight.record(first, last, lambda: False)
        if trouble is not None:
            raise trouble
        first += len(columns)
    return str(flight.compiled)


class _Flight:
    """The law and the vehicles that it flies."""

    def __init__(
        self, assembly: Assembly, start: Start, members: Sequence[int], threads: int
    ) -> None:
        self._assembly, self._control = assembly, assembly.scenario.rates.control
        self._law = FlownLaw(assembly.law, start.law, len(members))
        inner = self._law.inner if assembly.inner else None
        self.stepper = Stepper(assembly, start, members, threads=threads, inner=inner)
        self.compiled = CompiledBlocks(
            assembly, start, members, self.stepper, self._law, threads, BLOCK_PERIODS
        )
        # Each period, with law, signals and measurement.
        recorded = 4 * self.stepper.batch.state.nbytes
        self._periods = max(1, min(BLOCK_PERIODS, BLOCK_BYTES // recorded))
        self._seconds = 0.0  # of wall time, of a period of the last block

    def record(
        self, first: int, last: int, stop: Callable[[], bool]
    ) -> tuple[Columns, DesiredMotion, FlightError | Interrupted | None]:
        """Fly a block of periods; return what it recorded, what was desired, and what ended it.

        Where the period can be compiled, its first is flown in Python, and proves the rest; and the
        blocks that follow, up to ``BLOCK_PERIODS`` periods of each vehicle.

        Raises:
            FlightError: nothing was recorded.
        """
        began = clock.monotonic()
        count = _in_a_block(min(self._periods, last - first + 1), self._seconds)
        times = np.arange(first, first + count, dtype=float) * self._control
        desired = reference_at(self._assembly.reference, times)
        proved = self.compiled.fly_on(first, count, last, desired)
        if proved is not None:
            columns, trouble = proved, None
        elif not self.compiled.on:
            columns, _, trouble = self._fly_in_python(first, count, last, desired, stop)
        else:
            columns, period, trouble = self._fly_in_python(first, 1, last, desired, stop)
            count = _in_a_block(count, self._seconds or clock.monotonic() - began)
            if count > 1 and trouble is None:
                due = clock.monotonic() + BLOCK_SECONDS
                ends = lambda: stop() or clock.monotonic() > due  # noqa: E731 - both are conditions
                columns, trouble = self.compiled.fly(period, columns, count, last, desired, ends)
        self._seconds = (clock.monotonic() - began) / len(columns)
        return columns, desired, trouble

    def _fly_in_python(
        self,
        first: int,
        count: int,
        last: int,
        desired: DesiredMotion,
        stop: Callable[[], bool],
    ) -> tuple[Columns, ControlPeriod, FlightError | Interrupted | None]:
        """Return what ``count`` periods recorded, the last of them, and what ended them.

        Raises:
            FlightError: nothing was recorded.
        """
        recording: Recording | None = None
        due = clock.monotonic() + BLOCK_SECONDS
        now = first * self._control
        trouble: FlightError | Interrupted | None = None
        try:
            # A law's infinities are found in what it commands, not in NumPy's warnings.
            with np.errstate(all="ignore"):
                rows: Any = zip(*(array[:count] for array in desired), strict=True)
                for number, row in enumerate(rows, first):
                    now = number * self._control
                    period = self._begin_period(number, type(desired)(*row), number < last)
                    recording = recording or Recording(period, count, EVERYTHING)
                    try:
                        if number < last:
                            self.stepper.finish(period)
                    finally:
                        recording.write(period)
                    if stop() or clock.monotonic() > due:
                        break
        except (SimulationError, FlightError) as error:
            trouble = stopped_at(now, error)
            if recording is None:
                raise trouble from trouble.__cause__
        except Interrupted as error:
            if recording is None:
                raise
            trouble = error
        raised = np.flatnonzero(self.stepper.batch.warning[:, :, 1].any(axis=0))
        if trouble is None and len(raised):
            warning = mujoco.mjtWarning(int(raised[0])).name
            trouble = FlightError(
                f"MuJoCo warned ({warning}) between t = {first * self._control:.6g} s and now"
            )
        assert recording is not None
        return recording.columns(), period, trouble

    def _begin_period(self, number: int, reference: DesiredMotion, flown: bool) -> ControlPeriod:
        period = self.stepper.sense(number)
        period.law, period.command, period.signals = self._law.step(
            period.time, period.measurement, reference
        )
        self.stepper.begin(period, flown=flown)
        return period


def _in_a_block(count: int, seconds: float) -> int:
    """Return how many of ``count`` periods a block has, if one takes so many ``seconds``.

    All, if that is not known yet and 0; else at least two, of which the first proves the second.
    """
    if not seconds:
        return count
    return min(count, max(2, int(min(count, BLOCK_SECONDS / seconds))))
