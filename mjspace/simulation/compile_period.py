"""How a control period is taken down as a program: its Python code is called on traced arrays.

What it computes is then a list of calls of NumPy's loops on one memory, which a compiled function
repeats without Python.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from mjspace.contract import DesiredMotion
from mjspace.errors import FlightError, place_of
from mjspace.interrupts import Interrupted
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.hidden_memory import refusing_hidden_memory
from mjspace.simulation.period_program import Copies, PeriodProgram, Recorded
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.truth import truth_of
from mjspace.simulation.unbatched_law import UnbatchedLaw
from mjspace.tracing.inner_loops import Untraceable
from mjspace.tracing.program import Calls, Program
from mjspace.tracing.replay import prove
from mjspace.tracing.traced_array import TracedArray


def compile_period(
    assembly: Assembly,
    layout: StateLayout,
    example: ControlPeriod,
    reference: DesiredMotion,
    *,
    law: bool,
) -> PeriodProgram:
    """Return the program of a period like the ``example``, at which ``reference`` is desired.

    Without ``law`` it begins with the law's command.

    Raises:
        Untraceable: the law or an actuator does what cannot be taken down, and where.
    """
    try:
        with np.errstate(all="ignore"):
            tracing = _Tracing(assembly, layout, example, reference)
            if not law:
                return tracing.of_command(example.command)
            with refusing_hidden_memory(tracing.law) as tracing.law:
                return tracing.with_law()
    except (FlightError, TypeError, ValueError) as error:
        # Says which actuator, and where; or what a law returned has other fields than before.
        raise Untraceable(str(error)) from error


class _Tracing:
    """The arrays that a period begins with, in a program's memory."""

    def __init__(
        self,
        assembly: Assembly,
        layout: StateLayout,
        example: ControlPeriod,
        reference: DesiredMotion,
    ) -> None:
        self.assembly, self.layout = assembly, layout
        self.program = program = Program()
        self.time = program.copied(_elsewhere(example.time))
        self.physics = program.copied(_elsewhere(example.physics[:1]))
        self.sensordata = program.copied(_elsewhere(example.sensordata[:1]))
        self.reference = type(reference)(*(program.copied(_elsewhere(a)) for a in reference))
        self.memory = {name: self._held(array) for name, array in example.memory.items()}
        self.law_state = _tuple_like(example.law, map(self._held, example.law))
        self.inputs = [self.time, self.physics, *self.memory.values(), *self.law_state]
        self.inputs += self.reference
        self.sensors = {name: self._held(array) for name, array in example.sensors.items()}
        suite = assembly.sensors([0])
        self.biases = {name: self._held(array) for name, array in suite.biases.items()}
        self.draws = {name: self._held(array[0]) for name, array in suite.draws([1]).items()}
        self.inputs += [*self.sensors.values(), *self.biases.values(), *self.draws.values()]
        self.suite = suite.with_errors(
            self._traced_arrays(self.biases), self._traced_arrays(self.draws)
        )
        law = assembly.law
        self.law: Any = law.law if isinstance(law, UnbatchedLaw) else law

    def with_law(self) -> PeriodProgram:
        """Return the program of sensors, law and actuators.

        Raises:
            Untraceable: as ``compile_period``; or sensors sample at times of their own.
        """
        steps = self.assembly.scenario.rates.steps
        if self.suite.ticks - {steps}:
            raise Untraceable("sensors sample at other times than the control instants")
        before = tuple(self.sensors.values())
        with self.program.section() as sensing:
            # Not of sample 0, which integrating sensors begin with.
            sampled, measurement = self.suite.sample(
                self._traced_arrays(self.sensors), steps, self._truth()
            )
            after = self._next(before, tuple(sampled[name] for name in self.sensors))
            reports = self._reports(measurement)
            state, command, signals = self._law_step(measurement)
            state = self._next(self.law_state, state)
            command, signals = self._numbers(command), self._numbers(signals)
        prove(sensing[0], self.program.memory)
        changes = _changes(self.law_state, state) + _changes(before, after)
        for target, source in changes:
            target[...] = source
        recorded = [*_recorded("law", self.law_state), *_recorded("signals", signals)]
        recorded += [Recorded("sensors", name, array) for name, array in self.sensors.items()]
        recorded += reports
        return self._compiled(
            command,
            sensing=sensing[0],
            after_sensing=changes,
            recorded=recorded,
            kinds={"law": type(self.law_state), "signals": type(signals)},
        )

    def of_command(self, command: Any) -> PeriodProgram:
        """Return the program of the actuators under the law's ``command``.

        Raises:
            Untraceable: as ``compile_period``; or the law has an inner loop.
        """
        if self.assembly.inner:
            raise Untraceable("the law has an inner loop")
        if any(tick % self.assembly.scenario.rates.steps for tick in self.suite.ticks):
            raise Untraceable("sensors sample between control instants")
        with self.program.section() as nothing:
            pass
        held = (self._held(np.asarray(each, float)) for each in command)
        return self._compiled(
            _tuple_like(command, held),
            sensing=nothing[0],
            after_sensing=[],
            recorded=[],
            kinds={},
        )

    def _compiled(
        self,
        command: Any,
        *,
        sensing: Calls,
        after_sensing: Copies,
        recorded: list[Recorded],
        kinds: dict[str, type],
    ) -> PeriodProgram:
        """Return the program that goes on with the actuators; ``recorded`` is of the law."""
        own = tuple(self.memory.values())
        with self.program.section() as driving:
            truth, motors, inner = self._truth(), self._traced_tuple(command), self.law_state
            if self.assembly.inner:
                held = self.suite.report(self._traced_arrays(self.sensors), truth)
                inner, motors = self._law_inner(motors, held)
                inner = self._next(self.law_state, inner)
            memory, applied, saturated = self.assembly.actuators.act(
                self._traced_arrays(self.memory), motors, truth, self.assembly.hold
            )
            outputs = self._numbers(applied)
            (cut,) = self._numbers((saturated,))
            remembered = self._next(own, tuple(memory[name] for name in self.memory))
        prove(driving[0], self.program.memory)
        before = [Recorded("physics", "", self.physics)]
        before += [Recorded("memory", name, array) for name, array in self.memory.items()]
        before += [*recorded, *_recorded("command", command)]
        after = [Recorded("sensordata", "", self.sensordata)]
        after += [Recorded("applied", str(index), array) for index, array in enumerate(outputs)]
        return PeriodProgram(
            program=self.program,
            sensing=sensing,
            driving=driving[0],
            time=self.time,
            physics=self.physics,
            sensordata=self.sensordata,
            reference=self.reference,
            memory=self.memory,
            law=self.law_state,
            sensors=self.sensors,
            biases=self.biases,
            draws=self.draws,
            command=command,
            has_law="law" in kinds,
            after_sensing=after_sensing,
            after_driving=_changes(self.law_state, inner) + _changes(own, remembered),
            applied=outputs,
            saturated=cut,
            before=before,
            after=after,
            kinds=kinds | {"command": type(command)},
        )

    def _truth(self) -> Any:
        physics: Any = self._traced(self.physics)
        return truth_of(
            physics, self._traced_arrays(self.memory), self.layout, self.assembly.actuators, ()
        )

    def _reports(self, measurement: Any) -> list[Recorded]:
        """Return what is recorded of the ``measurement``; nothing where it follows from the truth.

        Of ideal sensors a block computes it for all of its periods at once.
        """
        if not self.suite.ticks:
            return []
        values = {name: value for name, value in measurement._asdict().items() if value.size}
        arrays = self._numbers(tuple(values.values()))
        return [
            Recorded("measurement", name, array) for name, array in zip(values, arrays, strict=True)
        ]

    def _law_step(self, measurement: Any) -> tuple[Any, Any, Any]:
        unbatched = isinstance(self.assembly.law, UnbatchedLaw)
        step = UnbatchedLaw(self.law).step_of_one if unbatched else self.law.step
        state, reference = self._traced_tuple(self.law_state), self._traced_tuple(self.reference)
        with _of_the_law():
            after, command, signals = step(state, self._traced(self.time), measurement, reference)
        return after or (), command, signals or ()

    def _law_inner(self, command: Any, measurement: Any) -> tuple[Any, Any]:
        state = self._traced_tuple(self.law_state)
        with _of_the_law():
            after, motors = self.law.inner(state, self._traced(self.time), command, measurement)
        return after or (), motors

    def _held(self, array: Any) -> np.ndarray:
        """Return one vehicle's part of an ``array`` of the example, in the memory."""
        array = np.asarray(array)
        if array.dtype not in (np.dtype(float), np.dtype(bool)):
            raise Untraceable(f"a state of {array.dtype}")
        return self.program.copied(_elsewhere(array[:1]))

    def _traced(self, array: np.ndarray) -> Any:
        view = array.view()
        view.setflags(write=False)
        return TracedArray(view, self.program)

    def _traced_tuple(self, arrays: Any) -> Any:
        return _tuple_like(arrays, map(self._traced, arrays))

    def _traced_arrays(self, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
        return {name: self._traced(array) for name, array in arrays.items()}

    def _next(self, before: Any, after: Any) -> Any:
        """Return the state that follows ``before``, in contiguous arrays that no input shares.

        A field that stays as it is, is the array that it was.
        """
        arrays = [
            value.array
            if isinstance(value, TracedArray)
            and (value.array.ctypes.data, value.array.strides) == (own.ctypes.data, own.strides)
            else self._own(value)
            for own, value in zip(before, after, strict=True)
        ]
        if [(a.shape, a.dtype) for a in arrays] != [(a.shape, a.dtype) for a in before]:
            raise Untraceable("a state has other shapes or types after a step")
        return _tuple_like(after, arrays)

    def _own(self, value: Any) -> np.ndarray:
        """Return a result in a contiguous array of the memory that no input shares."""
        if not isinstance(value, TracedArray):
            return self.program.copied(value)
        shared = any(np.may_share_memory(value.array, each) for each in self.inputs)
        if value.array.flags.c_contiguous and not shared:
            return value.array
        return value.copy().array

    def _numbers(self, values: Any) -> Any:
        """Return results, a tuple, as float64 in arrays that nothing else changes."""
        return _tuple_like(
            values,
            (
                self._own(value.astype(float))
                if isinstance(value, TracedArray) and value.dtype != float
                else self._own(value)
                for value in values
            ),
        )


def _elsewhere(values: Any) -> np.ndarray:
    """Return values near those of the flight, and none of them.

    If one of them is frozen in the program, the first period that it flies shows it.
    """
    array = np.asarray(values)
    return ~array if array.dtype == bool else array * (1.0 + 1e-6) + 1e-9


@contextmanager
def _of_the_law() -> Iterator[None]:
    """Name the line of the law that cannot be taken down, or that raised anything else."""
    try:
        yield
    except Interrupted:
        raise
    except BaseException as error:
        raise Untraceable(f"{error} ({place_of(error)})") from error


def _recorded(group: str, arrays: Any) -> list[Recorded]:
    """Return the fields of a named tuple, which may be empty."""
    names = getattr(arrays, "_fields", ())
    return [Recorded(group, name, array) for name, array in zip(names, arrays, strict=True)]


def _tuple_like(example: Any, values: Any) -> Any:
    """Return the ``values`` as a named tuple like the ``example``, which may be empty."""
    return type(example)(*values) if hasattr(example, "_fields") else tuple(values)


def _changes(targets: Any, sources: Any) -> Copies:
    """Return the copies that make ``targets`` what ``sources`` are."""
    pairs = zip(targets, sources, strict=True)
    return [(to, of) for to, of in pairs if to.ctypes.data != of.ctypes.data]
