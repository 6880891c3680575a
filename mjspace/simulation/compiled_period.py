"""A control period taken down as a program: sensors, law, inner loop and actuators.

The Python code of a period is called once, on traced arrays. What it computes is then a list of
calls of NumPy's loops on one memory, which a compiled function repeats without Python.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import DesiredMotion
from mjspace.errors import FlightError, place_of
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.control_period import ControlPeriod
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.truth import truth_of
from mjspace.simulation.unbatched_law import UnbatchedLaw
from mjspace.tracing.inner_loops import Untraceable
from mjspace.tracing.program import Calls, Program
from mjspace.tracing.replay import prove
from mjspace.tracing.traced_array import TracedArray

Copies = list[tuple[np.ndarray, np.ndarray]]
"""Pairs (to, from) of arrays of a program's memory."""


class Recorded(NamedTuple):
    """A field that is recorded each period: its group, its name, and the array that holds it."""

    group: str
    name: str
    array: np.ndarray


@dataclass(frozen=True)
class CompiledPeriod:
    """The program of one vehicle's control period; all arrays are views of its memory."""

    program: Program
    sensing: Calls
    """Of a control instant: the law."""
    driving: Calls
    """Of an integration step: inner loop and actuators."""
    time: np.ndarray
    """[s], shape ()."""
    physics: np.ndarray
    """MuJoCo's integration state, (1, nstate)."""
    sensordata: np.ndarray
    """MuJoCo's sensors, (1, nsensordata)."""
    reference: Any
    """The desired motion, a named tuple of arrays without a vehicle axis."""
    memory: dict[str, np.ndarray]
    """What the actuators remember, (1, ...)."""
    law: Any
    """The law's state, a named tuple of arrays (1, ...), or empty."""
    after_sensing: Copies
    after_driving: Copies
    applied: tuple[np.ndarray, ...]
    """What each kind of actuator applies, (1, width)."""
    saturated: np.ndarray
    """1.0 for each motor that saturates, (1, motors)."""
    before: list[Recorded]
    """Recorded at the control instant."""
    after: list[Recorded]
    """Recorded after the first integration step."""
    kinds: dict[str, type]
    """The named tuples of "law", "command" and "signals"."""


def compile_period(
    assembly: Assembly,
    layout: StateLayout,
    example: ControlPeriod,
    reference: DesiredMotion,
    sensordata: int,
) -> CompiledPeriod:
    """Return the program of a period like the ``example``, at which ``reference`` is desired.

    ``sensordata`` is how many numbers MuJoCo's sensors report.

    Raises:
        Untraceable: the law or an actuator does what cannot be taken down, and where.
    """
    try:
        with np.errstate(all="ignore"):
            return _Tracing(assembly, layout, example, reference, sensordata).compiled()
    except FlightError as error:
        # A part's exceptions are reported with their place; this one's was ours.
        if isinstance(error.__cause__, Untraceable):
            raise Untraceable(str(error)) from error
        raise Untraceable(f"it does not fly on traced arrays: {error}") from error


class _Tracing:
    """The arrays that a period begins with, in a program's memory."""

    def __init__(
        self,
        assembly: Assembly,
        layout: StateLayout,
        example: ControlPeriod,
        reference: DesiredMotion,
        sensordata: int,
    ) -> None:
        self.assembly, self.layout = assembly, layout
        self.program = program = Program()
        self.time = program.copied(example.time)
        self.physics = program.copied(example.physics[:1])
        self.sensordata = program.copied(np.zeros((1, sensordata)))
        self.reference = type(reference)(*map(program.copied, reference))
        self.memory = {name: self._held(array) for name, array in example.memory.items()}
        self.law_state = _tuple_like(example.law, map(self._held, example.law))
        self.inputs = [self.time, self.physics, *self.memory.values(), *self.law_state]
        self.inputs += self.reference
        self.suite = assembly.sensors([0])
        if self.suite.ticks:
            raise Untraceable("the sensors err, or sample at times of their own")

    def compiled(self) -> CompiledPeriod:
        assembly, program = self.assembly, self.program
        with program.section() as sensing:
            measurement = self._measured(self._truth())
            state, command, signals = self._law_step(measurement)
            state = self._next(self.law_state, state)
            numbers = [self._numbers(command), self._numbers(signals)]
        prove(sensing[0], program.memory)
        after_sensing = _changes(self.law_state, state)
        law, command_arrays, signal_arrays = self.law_state, *numbers
        for target, source in after_sensing:
            target[...] = source
        with program.section() as driving:
            truth = self._truth()
            motors = _tuple_like(command, map(self._traced, command_arrays))
            inner: Any = law
            if assembly.inner:
                inner, motors = self._law_inner(motors, self._measured(truth))
                inner = self._next(law, inner)
            memory, applied, saturated = assembly.actuators.act(
                self._all_traced_memory(), motors, truth, assembly.hold
            )
            outputs = self._numbers(applied)
            (cut,) = self._numbers([saturated])
            own = tuple(self.memory.values())
            remembered = self._next(own, tuple(memory[name] for name in self.memory))
        prove(driving[0], program.memory)
        after_driving = _changes(law, inner) + _changes(own, remembered)
        recorded = [Recorded("physics", "", self.physics)]
        recorded += [Recorded("memory", name, array) for name, array in self.memory.items()]
        named = (("law", law, law), ("command", command, command_arrays))
        for group, names, arrays in (*named, ("signals", signals, signal_arrays)):
            recorded += [
                Recorded(group, name, array)
                for name, array in zip(getattr(names, "_fields", ()), arrays, strict=True)
            ]
        after = [Recorded("sensordata", "", self.sensordata)]
        after += [Recorded("applied", str(index), array) for index, array in enumerate(outputs)]
        return CompiledPeriod(
            program=program,
            sensing=sensing[0],
            driving=driving[0],
            time=self.time,
            physics=self.physics,
            sensordata=self.sensordata,
            reference=self.reference,
            memory=self.memory,
            law=law,
            after_sensing=after_sensing,
            after_driving=after_driving,
            applied=outputs,
            saturated=cut,
            before=recorded,
            after=after,
            kinds={"law": type(law), "command": type(command), "signals": type(signals)},
        )

    def _truth(self) -> Any:
        physics: Any = self._traced(self.physics)
        return truth_of(
            physics, self._all_traced_memory(), self.layout, self.assembly.actuators, ()
        )

    def _measured(self, truth: Any) -> Any:
        _, measurement = self.suite.sample({}, 0, truth)
        return measurement

    def _law_step(self, measurement: Any) -> tuple[Any, Any, Any]:
        law: Any = self.assembly.law
        step = law.step_of_one if isinstance(law, UnbatchedLaw) else law.step
        state, reference = self._all_traced(self.law_state), self._all_traced(self.reference)
        with _of_the_law():
            after, command, signals = step(state, self._traced(self.time), measurement, reference)
        return after or (), command, signals or ()

    def _law_inner(self, command: Any, measurement: Any) -> tuple[Any, Any]:
        law: Any = self.assembly.law
        state = self._all_traced(self.law_state)
        with _of_the_law():
            after, motors = law.inner(state, self._traced(self.time), command, measurement)
        return after or (), motors

    def _held(self, array: Any) -> np.ndarray:
        """Return one vehicle's part of an ``array`` of the example, in the memory."""
        array = np.asarray(array)
        if array.dtype not in (np.dtype(float), np.dtype(bool)):
            raise Untraceable(f"a state of {array.dtype}")
        return self.program.copied(array[:1])

    def _traced(self, array: np.ndarray) -> Any:
        view = array.view()
        view.setflags(write=False)
        return TracedArray(view, self.program)

    def _all_traced(self, arrays: Any) -> Any:
        return _tuple_like(arrays, map(self._traced, arrays))

    def _all_traced_memory(self) -> dict[str, Any]:
        return {name: self._traced(array) for name, array in self.memory.items()}

    def _next(self, before: Any, after: Any) -> Any:
        """Return the state that follows ``before``, in contiguous arrays that no input shares.

        A field that stays as it is, is the array that it was.
        """
        arrays = [
            value.array
            if isinstance(value, TracedArray) and value.array.ctypes.data == own.ctypes.data
            else self._own(value)
            for own, value in zip(before, after, strict=True)
        ]
        if [each.shape for each in arrays] != [each.shape for each in before]:
            raise Untraceable("a state has other shapes after a step")
        return _tuple_like(after, arrays)

    def _own(self, value: Any) -> np.ndarray:
        """Return a result in a contiguous array of the memory that no input shares."""
        if not isinstance(value, TracedArray):
            return self.program.copied(value)
        shared = any(np.may_share_memory(value.array, each) for each in self.inputs)
        if value.array.flags.c_contiguous and not shared:
            return value.array
        return value.copy().array

    def _numbers(self, values: Any) -> tuple[np.ndarray, ...]:
        """Return results as float64 in arrays that nothing else changes."""
        return tuple(
            self._own(value.astype(float))
            if isinstance(value, TracedArray) and value.dtype != float
            else self._own(value)
            for value in values
        )


@contextmanager
def _of_the_law() -> Iterator[None]:
    """Name the line of the law that cannot be taken down, or that raised anything else."""
    try:
        yield
    except Exception as error:
        raise Untraceable(f"{error} ({place_of(error)})") from error


def _tuple_like(example: Any, values: Any) -> Any:
    """Return the ``values`` as a named tuple like the ``example``, which may be empty."""
    return type(example)(*values) if hasattr(example, "_fields") else tuple(values)


def _changes(targets: Any, sources: Any) -> Copies:
    """Return the copies that make ``targets`` what ``sources`` are."""
    pairs = zip(targets, sources, strict=True)
    return [(to, of) for to, of in pairs if to.ctypes.data != of.ctypes.data]
