"""Compiled blocks of a flight, each proved by its first period, which Python flies as well."""

import warnings
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from mujoco.batch import SimulationError

from mjspace.contract import Array, DesiredMotion
from mjspace.errors import FlightError
from mjspace.interrupts import Interrupted
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.compile_period import compile_period
from mjspace.simulation.compiled_flight import CompiledFlight
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.flown_law import FlownLaw
from mjspace.simulation.initial_state import Start
from mjspace.simulation.recording import OF_THE_LAW, Columns, Recording
from mjspace.simulation.stepper import Stepper
from mjspace.tracing.inner_loops import Untraceable
from mjspace.vehicle.step_effect import State


class CompiledBlocks:
    """The blocks of a flight after the first period of each.

    Attributes:
        on: whether the next block's inside is compiled.
        reason: why it is not, or why sensors and law are not; "" where all is.
    """

    def __init__(
        self,
        assembly: Assembly,
        start: Start,
        members: Sequence[int],
        stepper: Stepper,
        law: FlownLaw,
        threads: int,
    ) -> None:
        self._assembly, self._start = assembly, start
        self._members, self._threads = members, threads
        self._stepper, self._law = stepper, law
        self._flight: CompiledFlight | None = None
        effects = ", ".join(effect.name for effect in stepper.effects)
        self.reason = f"step effects are not compiled ({effects})" if effects else ""
        self.on = not effects

    def __str__(self) -> str:
        """Return what is compiled, in one line."""
        if not self.on:
            return f"flown in Python: {self.reason}"
        if self.reason:
            return f"actuators compiled; sensors and law called in Python: {self.reason}"
        return "compiled: sensors, law and actuators"

    def fly(
        self,
        first: ControlPeriod,
        columns: Columns,
        count: int,
        last: int,
        desired: DesiredMotion,
        stop: Callable[[], bool],
    ) -> tuple[Columns, FlightError | Interrupted | None]:
        """Return the columns of up to ``count`` periods, and what ended the flight after them.

        Python has flown the ``first``, whose ``columns`` are given. Where the compiled block cannot
        be had, or differs from them or in the state that they lead to, they are returned, and
        Python flies on. ``stop`` is called in each period in which the law is called in Python.
        """
        after = self._after_a_period()
        trouble: FlightError | Interrupted | None = None
        try:
            flight = self._flight or self._compile(first, desired)
            flight.set(first.physics, first.memory, first.sensors, first.law)
            flight.begin(first.number, count, last)
            if flight.has_law:
                flight.fly(desired)
                compiled = flight.columns()
            else:
                compiled, trouble = self._fly_law_in_python(flight, first, count, desired, stop)
        except (Untraceable, SimulationError) as error:
            self._off(str(error), after)  # MuJoCo raises the same in Python, which reports it
            return columns, None
        if flight.warned:
            self._off("MuJoCo warned", after)
            return columns, None
        if flight.broken_off:
            trouble = Interrupted(flight.broken_off)
            if not len(compiled):
                return columns, trouble
        different = _difference(columns, compiled) or after.difference(compiled)
        if different:
            warnings.warn(
                f"compiled, {different} differs from what Python computes at t = "
                f"{first.time:.6g} s: the flight goes on in Python",
                RuntimeWarning,
                stacklevel=2,
            )
            self._off(f"{different} differs from Python's", after)
            return columns, None
        self._take(flight)
        if flight.has_law:
            self._stepper.sensors = _copied(flight.sensors)
            kind: Any = type(flight.law)
            self._law.state = kind(*(values.copy() for values in flight.law)) if flight.law else ()
        return compiled, trouble

    def _fly_law_in_python(
        self,
        flight: CompiledFlight,
        first: ControlPeriod,
        count: int,
        desired: DesiredMotion,
        stop: Callable[[], bool],
    ) -> tuple[Columns, FlightError | Interrupted | None]:
        """Fly the block with the law, and the sensors, called in each period.

        Return its columns, and what ended the flight after them.
        """
        trouble: FlightError | Interrupted | None = None
        recording = Recording(first, count, OF_THE_LAW)
        flight.fly_period(first.command)
        if not flight.broken_off:
            recording.write(first)
        rows: Any = zip(*(array[1:count] for array in desired), strict=True)
        for number, row in enumerate(rows, first.number + 1):
            if flight.broken_off:
                break
            self._take(flight)
            period = self._stepper.sense(number)
            try:
                period.law, period.command, period.signals = self._law.step(
                    period.time, period.measurement, type(desired)(*row)
                )
                self._stepper.check(period.command)
            except FlightError as error:
                trouble = stopped_at(period.time, error)
                break
            except Interrupted as error:
                trouble = error
                break
            flight.fly_period(period.command)
            if not flight.broken_off:
                recording.write(period)
            if stop():
                break
        of_law, columns = recording.columns(), flight.columns()
        return Columns(of_law.groups | columns.groups, [], of_law.kinds), trouble

    def _take(self, flight: CompiledFlight) -> None:
        """Put the stepper where the compiled flight is."""
        self._stepper.batch.state[...] = flight.physics
        self._stepper.memory = _copied(flight.memory)

    def _compile(self, example: ControlPeriod, desired: DesiredMotion) -> CompiledFlight:
        """Return the compiled flight, of the law too if that can be.

        Raises:
            Untraceable: not even the actuators can be compiled.
        """
        arguments = self._assembly, self._stepper.layout, example
        reference = type(desired)(*(each[0] for each in desired))
        try:
            period = compile_period(*arguments, reference, law=True)
        except Untraceable as error:
            self.reason = str(error)
            try:
                period = compile_period(*arguments, reference, law=False)
            except Untraceable as another:
                raise Untraceable(f"{error}, and {another}") from another
        self._flight = CompiledFlight(
            self._assembly,
            self._stepper.layout,
            period,
            self._start,
            self._members,
            self._threads,
        )
        return self._flight

    def _after_a_period(self) -> "_After":
        stepper = self._stepper
        return _After(stepper.batch.state.copy(), stepper.memory, stepper.sensors, self._law.state)

    def _off(self, reason: str, after: "_After") -> None:
        """Let Python fly on from ``after`` the first period."""
        self.on, self.reason, self._flight = False, reason, None
        stepper = self._stepper
        stepper.batch.state[...] = after.physics
        stepper.memory, stepper.sensors, self._law.state = after[1:]


def stopped_at(time: float, error: Exception) -> FlightError:
    """Return the error that ends a flight at that ``time`` [s]."""
    trouble = FlightError(f"stopped at t = {time:.6g} s: {error}")
    trouble.__cause__ = error.__cause__ or error
    return trouble


def _copied(state: State) -> State:
    return {name: values.copy() for name, values in state.items()}


class _After(NamedTuple):
    """What a flight goes on from after the first period of a block."""

    physics: Array
    memory: State
    sensors: State
    law: Any

    def difference(self, compiled: Columns) -> str:
        """Return the name of the first field whose second row is another; "" for none."""
        names = getattr(self.law, "_fields", ())
        groups = {
            "physics": {"": self.physics},
            "memory": self.memory,
            "sensors": self.sensors,
            "law": dict(zip(names, self.law or (), strict=True)),
        }
        for group, arrays in groups.items():
            for name, rows in compiled[group].items():
                if len(rows) > 1 and _bits(rows[1]) != _bits(arrays[name]):
                    return f"{group} {name} after a period".replace("  ", " ")
        return ""


def _difference(one: Columns, other: Columns) -> str:
    """Return the name of the first field whose first rows differ in any bit; "" for none."""
    for group in sorted(one.groups.keys() | other.groups.keys()):
        if one[group].keys() != other[group].keys():
            return f"{group} ({', '.join(one[group].keys() ^ other[group].keys())})"
        for name, values in one[group].items():
            if _bits(values[:1]) != _bits(other[group][name][:1]):
                return f"{group} {name}".rstrip()
    return ""


def _bits(values: Array) -> tuple[tuple[int, ...], bytes]:
    return values.shape, np.asarray(values, dtype=float).tobytes()
