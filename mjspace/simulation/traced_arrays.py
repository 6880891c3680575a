"""The arrays that a control period begins with, in a program's memory, and what is made of them."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from mjspace.simulation.period_program import Copies
from mjspace.tracing.inner_loops import Untraceable
from mjspace.tracing.program import Program
from mjspace.tracing.traced_array import TracedArray
from mjspace.vehicle.step_effect import Write


class TracedArrays:
    """Arrays of one vehicle in the memory of a program.

    Attributes:
        program: that program.
        inputs: what a section must not change while it runs.
    """

    def __init__(self) -> None:
        self.program = Program()
        self.inputs: list[np.ndarray] = []

    def held(self, values: Any) -> np.ndarray:
        """Return an input with values near those given, and none of them.

        If one of them is frozen in the program, the first period that it flies shows it.
        """
        array = np.asarray(values)
        near = ~array if array.dtype == bool else array * (1.0 + 1e-6) + 1e-9
        own = self.program.copied(near)
        self.inputs.append(own)
        return own

    def held_of_one(self, array: Any) -> np.ndarray:
        """Return one vehicle's part of what is remembered of all, as an input.

        Raises:
            Untraceable: it holds neither float64 nor bool.
        """
        array = np.asarray(array)
        if array.dtype not in (np.dtype(float), np.dtype(bool)):
            raise Untraceable(f"a state of {array.dtype}")
        return self.held(array[:1])

    def held_arrays(self, arrays: dict[str, Any]) -> dict[str, np.ndarray]:
        """Return one vehicle's part of named arrays likewise."""
        return {name: self.held_of_one(array) for name, array in arrays.items()}

    def traced(self, array: np.ndarray) -> Any:
        """Return an array of the memory as code that is taken down receives it, read-only."""
        view = array.view()
        view.setflags(write=False)
        return TracedArray(view, self.program)

    def traced_tuple(self, arrays: Any) -> Any:
        """Return a named tuple of arrays likewise."""
        return tuple_like(arrays, map(self.traced, arrays))

    def traced_arrays(self, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
        """Return named arrays likewise."""
        return {name: self.traced(array) for name, array in arrays.items()}

    def following(self, before: Any, after: Any) -> Any:
        """Return the state that follows ``before``, in contiguous arrays that no input shares.

        A field that stays as it is, is the array that it was.

        Raises:
            Untraceable: a field has another shape or type.
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
        return tuple_like(after, arrays)

    def numbers(self, values: Any) -> Any:
        """Return results, a tuple, as float64 in arrays that nothing else changes."""
        return tuple_like(
            values,
            (
                self._own(value.astype(float))
                if isinstance(value, TracedArray) and value.dtype != float
                else self._own(value)
                for value in values
            ),
        )

    def own_numbers(self, writes: Iterable[Write]) -> list[Write]:
        """Return the writes with arrays that nothing else changes."""
        return [each._replace(values=self.numbers((each.values,))[0]) for each in writes]

    def report(self, reports: Iterable[Any]) -> np.ndarray:
        """Return as one array where there is an event to tell."""
        given = [report.astype(float).reshape(-1) for report in reports if report is not None]
        return self.numbers((np.concatenate(given),))[0] if given else np.zeros(0)

    def _own(self, value: Any) -> np.ndarray:
        """Return a result in a contiguous array of the memory that no input shares."""
        if not isinstance(value, TracedArray):
            return self.program.copied(value)
        shared = any(np.may_share_memory(value.array, each) for each in self.inputs)
        if value.array.flags.c_contiguous and not shared:
            return value.array
        return value.copy().array


def tuple_like(example: Any, values: Iterable[Any]) -> Any:
    """Return the ``values`` as a named tuple like the ``example``, which may be empty."""
    return type(example)(*values) if hasattr(example, "_fields") else tuple(values)


def changes(targets: Iterable[np.ndarray], sources: Iterable[np.ndarray]) -> Copies:
    """Return the copies that make ``targets`` what ``sources`` are."""
    pairs = zip(targets, sources, strict=True)
    return [(to, of) for to, of in pairs if to.ctypes.data != of.ctypes.data]
