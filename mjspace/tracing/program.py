"""A program: calls of inner loops in order, and the memory that they work on.

All operands lie in one memory, and a call knows them by their offsets in it. A copy of the memory,
wherever it lies, is another instance of the program: each thread has its own.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from mjspace.tracing.inner_loops import Untraceable, inner_loop

MEMORY = 1 << 20
"""Size of a program's memory while it is taken down [bytes]."""
_BOOL, _FLOAT = np.dtype(bool), np.dtype(float)
_Array = NDArray[Any]


@dataclass(frozen=True)
class Calls:
    """Calls of inner loops in order, as compiled code reads them.

    A row of ``table`` is (address of the loop, its data, and where in ``words`` its operands, its
    dimensions and its steps begin). ``words`` that ``relative`` marks are offsets in the memory.
    """

    table: _Array
    """(calls, 5), int64."""
    words: _Array
    """(n,), int64."""
    relative: _Array
    """(n,), int64: 1 or 0."""


@dataclass
class _Section:
    calls: list[tuple[int, int, int, int, int]] = field(default_factory=list)
    words: list[int] = field(default_factory=list)
    relative: list[int] = field(default_factory=list)

    def finished(self) -> Calls:
        table = np.array(self.calls, np.int64).reshape(-1, 5)
        return Calls(table, np.array(self.words, np.int64), np.array(self.relative, np.int64))


class Program:
    """The memory, and the calls of the section that is being taken down."""

    def __init__(self) -> None:
        self._memory = np.zeros(MEMORY // 8).view(np.uint8)
        self._base = int(self._memory.ctypes.data)
        self._used = 0
        self._section: _Section | None = None
        self._failure: Exception | None = None
        self._ufuncs: set[np.ufunc] = set()  # kept alive: their loops are called by address

    @contextmanager
    def section(self) -> Iterator[list[Calls]]:
        """Take down calls until the end of the context; the list then holds them.

        Raises:
            Untraceable: something could not be taken down, even if the code caught that.
        """
        taken: list[Calls] = []
        self._section = _Section()
        try:
            yield taken
            if self._failure is not None:
                raise Untraceable(str(self._failure)) from self._failure
            taken.append(self._section.finished())
        finally:
            self._section = None

    @property
    def memory(self) -> _Array:
        """Return the memory in use, (bytes,) of uint8: a view."""
        return self._memory[: self._used]

    def failed(self, error: Exception) -> None:
        """Let the section end with the ``error``, whatever the code makes of it."""
        self._failure = self._failure or error

    def refuse(self, reason: str) -> NoReturn:
        """Raise ``Untraceable``; the section ends with it, even if the code catches it."""
        error = Untraceable(reason)
        self.failed(error)
        raise error

    def copied(self, values: Any) -> _Array:
        """Return a copy of ``values`` in the memory, contiguous, float64 or bool.

        Raises:
            Untraceable: they are of a kind that float64 cannot hold, or the memory is full.
        """
        return self._placed(np.array(values, order="C"))

    def result(self, values: Any) -> _Array:
        """Return a copy of what NumPy computed, laid out as that is; of a number, read-only.

        Raises:
            Untraceable: it is neither of float64 nor of bool, or the memory is full.
        """
        kind = np.asarray(values).dtype
        if kind not in (_BOOL, _FLOAT):
            raise Untraceable(f"a result of {kind}")
        array = self._placed(np.array(values, order="K"))
        array.setflags(write=isinstance(values, np.ndarray))
        return array

    def _placed(self, laid_out: _Array) -> _Array:
        if not np.can_cast(laid_out.dtype, _FLOAT):
            raise Untraceable(f"an array of {laid_out.dtype}")
        if laid_out.dtype != _BOOL:
            laid_out = laid_out.astype(_FLOAT)
        if self._used + laid_out.nbytes > MEMORY:
            raise Untraceable(f"more than {MEMORY} bytes of arrays")
        array = self.at(self._used, laid_out.shape, laid_out.strides, laid_out.dtype)
        array[...] = laid_out
        self._used += -(-laid_out.nbytes // 8) * 8
        return array

    def holds(self, array: _Array) -> bool:
        """Return whether the ``array`` is a view of the memory."""
        return 0 <= self._offset(array) < MEMORY

    def offset(self, array: _Array) -> int:
        """Return where an ``array`` of the memory begins [bytes].

        Raises:
            Untraceable: it is another array.
        """
        if not self.holds(array):
            raise Untraceable("a NumPy array that measured values are written to")
        return self._offset(array)

    def at(
        self, offset: int, shape: tuple[int, ...], strides: tuple[int, ...], kind: np.dtype[Any]
    ) -> _Array:
        """Return the array of that ``kind`` that begins at ``offset``, with ``strides`` [bytes]."""
        return np.ndarray(shape, kind, self._memory, offset, strides)

    def apply(self, ufunc: np.ufunc, operands: Sequence[_Array]) -> None:
        """Take down a call on arrays of the memory, broadcast to the shape of the last.

        The last is gone through as it lies in the memory, which is how NumPy goes: the larger of 0
        and -0 depends on how many elements are compared at once.
        """
        shape = operands[-1].shape
        order = np.argsort([-abs(step) for step in operands[-1].strides], kind="stable")
        views = [_broadcast(each, shape).transpose(order) for each in operands]
        for lead, (length, *steps) in _runs(views):
            self._call(ufunc, lead, (length,), steps)

    def apply_core(self, ufunc: np.ufunc, signature: str, operands: Sequence[_Array]) -> None:
        """Take down a call of a generalized ufunc, whose ``signature`` names its core dimensions.

        The last operand has all of the outer dimensions.
        """
        cores = [
            [name for name in part.split(",") if name]
            for part in signature.replace(" ", "").replace("->", ",")[1:-1].split("),(")
        ]
        sizes: dict[str, int] = {}
        for each, core in zip(operands, cores, strict=True):
            for name, size in zip(core, each.shape[each.ndim - len(core) :], strict=True):
                sizes.setdefault(name, size)
        outer = operands[-1].shape[: operands[-1].ndim - len(cores[-1])]
        whole = [
            _broadcast(each, outer + each.shape[each.ndim - len(core) :])
            for each, core in zip(operands, cores, strict=True)
        ]
        for index in np.ndindex(*outer):
            views = [each[(*index, ...)] for each in whole]
            steps = [0] * len(views) + [step for view in views for step in view.strides]
            self._call(ufunc, views, (1, *sizes.values()), steps)

    def reduce(self, ufunc: np.ufunc, source: _Array, target: _Array) -> None:
        """Take down the reduction of the last axis of ``source`` into ``target``, (...)."""
        for index in np.ndindex(*target.shape):
            result, row = target[(*index, ...)], source[(*index, ...)]
            self._call(ufunc, [result, row, result], (len(row),), [0, *row.strides, 0])

    def copy(self, source: _Array, target: _Array) -> None:
        """Take down a copy between arrays of the memory of the same kind."""
        if target.dtype == _BOOL:
            self.apply(np.logical_or, [source, source, target])
        else:
            self.apply(np.positive, [source, target])

    def _call(
        self,
        ufunc: np.ufunc,
        operands: Sequence[_Array],
        dimensions: Sequence[int],
        steps: Sequence[int],
    ) -> None:
        if self._section is None:
            raise Untraceable("an array kept from an earlier call")
        loop = inner_loop(ufunc, tuple(each.dtype for each in operands))
        self._ufuncs.add(ufunc)
        section = self._section
        first = len(section.words)
        section.words += [*map(self.offset, operands), *dimensions, *steps]
        section.relative += [1] * len(operands) + [0] * (len(dimensions) + len(steps))
        at = first + len(operands)
        section.calls.append((loop.address, loop.data, first, at, at + len(dimensions)))

    def _offset(self, array: _Array) -> int:
        return int(array.ctypes.data) - self._base


def _broadcast(array: _Array, shape: tuple[int, ...]) -> _Array:
    """Return ``np.broadcast_to`` of it, which takes its time where nothing is to be done."""
    return array if array.shape == shape else np.broadcast_to(array, shape)


def _runs(views: Sequence[_Array]) -> Iterator[tuple[list[_Array], tuple[int, ...]]]:
    """Yield (arrays of the first elements, (length, step of each)) of as long runs as there are.

    ``views`` have one shape. Axes along which every view goes on with one step are one run.
    """
    shape = views[0].shape
    if 0 in shape:
        return
    axis, length = len(shape), 1
    steps = [0] * len(views)
    while axis:
        strides = [view.strides[axis - 1] for view in views]
        if shape[axis - 1] != 1:
            if length > 1 and any(
                s != length * step for s, step in zip(strides, steps, strict=True)
            ):
                break
            if length == 1:
                steps = strides
            length *= shape[axis - 1]
        axis -= 1
    for index in np.ndindex(*shape[:axis]):
        firsts = [view[(*index, ..., *[slice(0, 1)] * (len(shape) - axis))] for view in views]
        yield firsts, (length, *steps)
