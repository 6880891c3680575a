"""Compiled blocks of a flight, each proved by its first period, which Python flies as well."""

import time as clock
import warnings
from dataclasses import fields
from typing import Any

import numpy as np
from mujoco.batch import SimulationError

from mjspace.contract import DesiredMotion
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.compiled_flight import CompiledFlight
from mjspace.simulation.compiled_period import compile_period
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.flown_law import FlownLaw
from mjspace.simulation.initial_state import Start
from mjspace.simulation.recording import Columns
from mjspace.simulation.stepper import Stepper
from mjspace.tracing.inner_loops import Untraceable

_FIRST_PERIODS = 100
"""Of the first block, from which the time that a period takes is learnt."""


class CompiledBlocks:
    """The blocks of a flight after the first period of each.

    Attributes:
        on: whether the next block's inside is compiled.
        reason: why it is not.
    """

    def __init__(
        self, assembly: Assembly, start: Start, stepper: Stepper, law: FlownLaw, threads: int
    ) -> None:
        self._assembly, self._start, self._threads = assembly, start, threads
        self._stepper, self._law = stepper, law
        self._flight: CompiledFlight | None = None
        self._seconds = 0.0
        self.reason = ", ".join(effect.name for effect in stepper.effects)
        self.on = not self.reason

    def periods_in(self, seconds: float) -> int:
        """Return about how many periods are flown in so many seconds of wall time."""
        return max(2, int(seconds / self._seconds)) if self._seconds else _FIRST_PERIODS

    def fly(
        self,
        first: ControlPeriod,
        columns: Columns,
        count: int,
        last: int,
        desired: DesiredMotion,
    ) -> Columns:
        """Return the columns of ``count`` periods, of which Python has flown the ``first``.

        ``columns`` are that period's. Where the compiled block cannot be had, or differs from them
        or in the state that they lead to, they are returned, and Python flies on.
        """
        began = clock.monotonic()
        try:
            flight = self._flight or self._compile(first, desired)
        except Untraceable as error:
            return self._off(str(error), columns)
        flight.set(first.physics, first.memory, first.law)
        try:
            compiled = flight.fly(first.number, count, last, desired)
        except SimulationError as error:
            return self._off(str(error), columns)
        if flight.warned:
            return self._off("MuJoCo warned", columns)  # and Python finds out of what
        after = self._stepper.batch.state
        different = _difference(columns, compiled)
        if not different and compiled.physics[1].tobytes() != after.tobytes():
            different = "the state after a period"
        if different:
            warnings.warn(
                f"compiled, {different} differs from what Python computes at t = "
                f"{first.time:.6g} s: the flight goes on in Python",
                RuntimeWarning,
                stacklevel=2,
            )
            return self._off(f"{different} differs from Python's", columns)
        after[...] = flight.physics
        self._stepper.memory = {name: values.copy() for name, values in flight.memory.items()}
        self._law.state = type(flight.law)(*(values.copy() for values in flight.law))
        self._seconds = (clock.monotonic() - began) / count
        return compiled

    def _compile(self, example: ControlPeriod, desired: DesiredMotion) -> CompiledFlight:
        layout, reference = self._stepper.layout, type(desired)(*(each[0] for each in desired))
        period = compile_period(
            self._assembly, layout, example, reference, example.sensordata.shape[-1]
        )
        self._flight = CompiledFlight(self._assembly, layout, period, self._start, self._threads)
        return self._flight

    def _off(self, reason: str, columns: Columns) -> Columns:
        self.on, self.reason, self._flight = False, reason, None
        return columns


def _difference(one: Columns, other: Columns) -> str:
    """Return the name of the first field whose first rows differ in any bit; "" for none."""
    for field in fields(Columns):
        name = field.name
        mine, others = _named(getattr(one, name)), _named(getattr(other, name))
        if name in ("events", "kinds"):
            continue
        if mine.keys() != others.keys():
            return f"{name} ({', '.join(mine.keys() ^ others.keys())})"
        for key, values in mine.items():
            if _bits(values[:1]) != _bits(others[key][:1]):
                return f"{name} {key}".rstrip()
    return ""


def _named(value: Any) -> dict[str, Any]:
    if isinstance(value, dict):
        return value
    if isinstance(value, tuple):
        return {str(index): each for index, each in enumerate(value)}
    return {} if value is None else {"": value}


def _bits(values: Any) -> tuple[tuple[int, ...], bytes]:
    return np.shape(values), np.asarray(values, dtype=float).tobytes()
