"""Compiled blocks of a flight, proved by periods which Python flies as well."""

import itertools
import warnings
from collections.abc import Callable, Iterator, Sequence
from math import inf
from typing import Any

import numpy as np
from mujoco.batch import SimulationError

from mjspace.contract import TICK, DesiredMotion, Measurement
from mjspace.errors import FlightError
from mjspace.interrupts import Interrupted
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.compile_period import compile_period
from mjspace.simulation.compiled_flight import CompiledFlight
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.flown_law import FlownLaw
from mjspace.simulation.initial_state import Start
from mjspace.simulation.law_calls import LawCalls
from mjspace.simulation.proof import AfterPeriod, difference
from mjspace.simulation.recording import OF_SENSORS, Columns, Recording
from mjspace.simulation.stepper import Stepper
from mjspace.tracing.inner_loops import Untraceable
from mjspace.vehicle.step_effect import State

_NEVER = 2**62


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
        proof: int,
    ) -> None:
        """A ``proof`` is good for so many periods."""
        self._assembly, self._start, self._proof = assembly, start, proof
        self._reached = self._proved = -1
        self._members, self._threads = members, threads
        self._stepper, self._law = stepper, law
        self._integrates = any(each.integrates for each in assembly.scenario.sensors.values())
        self._flight: CompiledFlight | None = None
        self.reason = ", and ".join(
            f"{effect.name}: {effect.not_compiled}"
            for effect in stepper.effects
            if effect.not_compiled
        )
        self.on = not self.reason
        self._fields = sorted({name for effect in stepper.effects for name in effect.fields})

    @property
    def is_to_be_seen(self) -> bool:
        """Whether none has been flown yet, and nothing keeps the flight in Python."""
        return self.on and self._flight is None

    def __str__(self) -> str:
        """Return what is compiled, in one line."""
        if not self.on:
            return f"flown in Python: {self.reason}"
        called = ["law"] if self.reason else []
        if called and (self._flight is None or not self._flight.has_sensors):
            called = ["sensors", "law"]
        parts = [part for part in ("sensors", "law", "actuators") if part not in called]
        if effects := ", ".join(effect.name for effect in self._stepper.effects):
            parts.append(f"step effects ({effects})")
        if not called:
            return f"compiled: {_listed(parts)}"
        return f"{_listed(parts)} compiled; {_listed(called)} called in Python: {self.reason}"

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
        count = min(count, self._due(first.number + 1) - first.number)
        if count < 2 or columns.events:  # compiled code has no events, and cannot be held to it
            return columns, None
        if first.number == 0 and self._integrates:  # whose sample 0 is unlike the others
            return columns, None
        after = self._after_a_period()
        trouble: FlightError | Interrupted | None = None
        second = after._replace(memory=self._stepper.observed(first.number + 1))
        try:
            flight = self._flight or self._compile(first, desired)
            flight.follow({name: self._stepper.batch.expand(name) for name in self._fields})
            flight.set(first.physics, first.memory, first.sensors, first.law)
            if flight.has_law:
                flight.begin(first.number, count, last, desired, ())
                flight.fly_periods(count)
                if 2 <= flight.told < count and not flight.broken_off:
                    # Python flies the period in which something is told
                    count = flight.told
                    flight.set(first.physics, first.memory, first.sensors, first.law)
                    flight.begin(first.number, count, last, desired, ())
                    flight.fly_periods(count)
                compiled = flight.columns()
            else:
                compiled, trouble = self._call_law(flight, first, count, last, desired, stop)
        except (Untraceable, SimulationError) as error:
            self._off(str(error), after)  # MuJoCo raises the same in Python, which reports it
            return columns, None
        if flight.warned:
            self._off("MuJoCo warned", after)
            return columns, None
        if flight.broken_off:
            trouble = Interrupted(flight.broken_off)
        if flight.told < 2:
            self._go_back_to(after)
            return columns, trouble
        different = difference(columns, compiled) or second.difference(compiled)
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
        self._reached, self._proved = first.number + len(compiled), first.number
        return compiled, trouble

    def fly_on(self, first: int, count: int, last: int, desired: DesiredMotion) -> Columns | None:
        """Return the columns of ``count`` periods that the last proof is good for as well.

        Many vehicles have short blocks: each would cost them all a period in Python. None where
        there is no such proof, and where MuJoCo raises or warns: Python flies on.
        """
        flight = self._flight
        if flight is None or not flight.has_law or self._stepper.effects:
            return None
        if first != self._reached or first + count > self._proved + self._proof:
            return None
        before = self._after_a_period()
        flight.begin(first, count, last, desired, ())
        try:
            flight.fly_periods(count)
        except SimulationError as error:
            self._off(str(error), before)
            return None
        if flight.warned:
            self._off("MuJoCo warned", before)
            return None
        self._take(flight)
        self._reached += count
        return flight.columns()

    def _call_law(
        self,
        flight: CompiledFlight,
        first: ControlPeriod,
        count: int,
        last: int,
        desired: DesiredMotion,
        stop: Callable[[], bool],
    ) -> tuple[Columns, FlightError | Interrupted | None]:
        """Fly the block with the law called in each period, and the sensors if not compiled.

        Return its columns, and what ended the flight after them.
        """
        calls = LawCalls(self._law, first, count, self._stepper.check)
        flight.begin(first.number, count, last, desired, calls.commands)
        flight.fly_to_instant(0)
        sensing = None if flight.has_sensors else Recording(first, count, OF_SENSORS)
        measured: Iterator[Sequence[Measurement]]
        if sensing is None:
            measured = calls.measurements(flight.measured())
        else:
            measured = self._sensed(flight, first, calls, sensing)
        control = self._assembly.scenario.rates.control
        rows: Any = zip(*(array[1:count] for array in desired), strict=True)
        flown = 1
        trouble: FlightError | Interrupted | None = None
        with np.errstate(all="ignore"):
            for k, row in enumerate(rows, 1):
                flight.fly_to_instant(k)
                if flight.told <= k:
                    break
                time = (first.number + k) * control
                try:
                    calls.step(k, time, next(measured), type(desired)(*row))
                except FlightError as error:
                    trouble = stopped_at(time, error)
                    break
                except Interrupted as error:
                    trouble = error
                    break
                flown = k + 1
                if stop():
                    break
        flight.fly_periods(flown)
        if flight.broken_off:
            flown = min(flown, flight.told)
        elif flight.told < count:  # Python flies the period in which something is told
            called, flown, trouble = flown, min(flown, flight.told), None
            flight.set(first.physics, first.memory, first.sensors, first.law)
            flight.begin(first.number, flown, last, desired, calls.commands)
            flight.fly_periods(flown)
            if sensing is not None:
                self._stepper.sensors = sensing.sensors_before(flown, self._stepper.sensors)
            if called > flown > 0:
                time = (first.number + flown) * control
                self._law.called = time, *calls.returned(flown)
        self._law.state = calls.state_before(flown)
        groups = flight.columns().groups | calls.groups(flown)
        if sensing is not None:
            groups |= sensing.columns(flown).groups
        return Columns(groups, [], calls.kinds), trouble

    def _sensed(
        self, flight: CompiledFlight, first: ControlPeriod, calls: LawCalls, recording: Recording
    ) -> Iterator[Sequence[Measurement]]:
        """Yield what each call of the law measures in each period, of sensors called in Python."""
        recording.write(first)
        for number in itertools.count(first.number + 1):
            self._take(flight)
            period = self._stepper.sense(number)
            recording.write(period)
            yield calls.of_each(period.measurement)

    def _due(self, number: int) -> int:
        """Return the first period from that ``number`` on in which an event is sure to happen.

        What is due between two integration steps happens in one of them: one before ``number``,
        where that may be in the first step of it.
        """
        rates = self._assembly.scenario.rates
        after = number * rates.control - rates.physics
        due = min((effect.due(after) for effect in self._stepper.effects), default=inf)
        return int(min((due + TICK) / rates.control, _NEVER))

    def _take(self, flight: CompiledFlight) -> None:
        """Put the stepper where the compiled flight is."""
        self._stepper.batch.state[...] = flight.physics
        self._stepper.memory = _copied(flight.memory)
        if flight.has_sensors:
            self._stepper.sensors = _copied(flight.sensors)
        if flight.has_law:
            kind: Any = type(flight.law)
            self._law.state = kind(*(values.copy() for values in flight.law)) if flight.law else ()

    def _compile(self, example: ControlPeriod, desired: DesiredMotion) -> CompiledFlight:
        """Return the compiled flight, of the law too if that can be.

        Raises:
            Untraceable: not even the actuators can be compiled.
        """
        arguments = self._assembly, self._stepper.layout, self._stepper.effects, example
        reference = type(desired)(*(each[0] for each in desired))
        reasons = []
        for law, sensors in ((True, True), (False, True), (False, False)):
            try:
                period = compile_period(*arguments, reference, law=law, sensors=sensors)
                break
            except Untraceable as error:
                reasons.append(str(error))
        else:
            raise Untraceable(", and ".join(dict.fromkeys(reasons)))
        self.reason = ", and ".join(dict.fromkeys(reasons))
        self._flight = CompiledFlight(
            self._assembly,
            self._stepper.layout,
            self._stepper.effects,
            period,
            self._start,
            self._members,
            self._threads,
        )
        return self._flight

    def _after_a_period(self) -> AfterPeriod:
        stepper = self._stepper
        return AfterPeriod(
            stepper.batch.state.copy(), stepper.memory, stepper.sensors, self._law.state
        )

    def _off(self, reason: str, after: AfterPeriod) -> None:
        """Let Python fly on from ``after`` the first period."""
        self.on, self.reason, self._flight, self._law.called = False, reason, None, None
        self._go_back_to(after)

    def _go_back_to(self, then: AfterPeriod) -> None:
        """Put stepper and law where they were ``then``, after another period."""
        stepper = self._stepper
        stepper.batch.state[...] = then.physics
        stepper.memory, stepper.sensors, self._law.state = then[1:]


def _listed(parts: Sequence[str]) -> str:
    """Return the parts as a sentence has them."""
    *others, last = parts
    return f"{', '.join(others)} and {last}" if others else last


def stopped_at(time: float, error: Exception) -> FlightError:
    """Return the error that ends a flight at that ``time`` [s]."""
    trouble = FlightError(f"stopped at t = {time:.6g} s: {error}")
    trouble.__cause__ = error.__cause__ or error
    return trouble


def _copied(state: State) -> State:
    return {name: values.copy() for name, values in state.items()}
