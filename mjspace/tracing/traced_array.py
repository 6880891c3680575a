"""An array whose use is taken down in a program.

It is no ``np.ndarray``, so that nothing can turn it into numbers unnoticed: what would freeze its
present values, as a branch on one does, or ``float``, or ``np.asarray``, raises ``Untraceable``.
"""

from collections.abc import Callable, Iterator
from typing import Any, NoReturn

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from mjspace.tracing import functions, ufuncs
from mjspace.tracing.inner_loops import Untraceable
from mjspace.tracing.program import Program

_METHODS = (
    *("all", "any", "clip", "max", "mean", "min", "prod", "ravel", "repeat", "reshape", "squeeze"),
    *("sum", "swapaxes", "take", "transpose", "diagonal"),
)
"""Methods of arrays that are functions of NumPy as well."""


class TracedArray(NDArrayOperatorsMixin):
    """An array of a program's memory, as the code that is taken down receives it."""

    __slots__ = ("array", "program")

    def __init__(self, array: np.ndarray, program: Program) -> None:
        self.array, self.program = array, program

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        return self._applied(ufuncs.apply, ufunc, method, inputs, options)

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        return self._applied(functions.apply, function, args, kwargs)

    @property
    def shape(self) -> tuple[int, ...]:
        """Length along each axis, as of any array."""
        return self.array.shape

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return self.array.ndim

    @property
    def size(self) -> int:
        """Number of elements."""
        return self.array.size

    @property
    def dtype(self) -> np.dtype[Any]:
        """float64 or bool."""
        return self.array.dtype

    @property
    def T(self) -> "TracedArray":  # noqa: N802 - an array's name for it
        """Return the transposed, as an array does."""
        return TracedArray(self.array.T, self.program)

    def __len__(self) -> int:
        return len(self.array)

    def __iter__(self) -> Iterator[Any]:
        return (self[index] for index in range(len(self)))

    def __getitem__(self, index: Any) -> Any:
        _refuse_traced(index)
        return self._applied(functions.move, lambda array: array[index], self)

    def __setitem__(self, index: Any, value: Any) -> None:
        _refuse_traced(index)
        self._applied(functions.assign, self, index, value)

    def __pow__(self, exponent: Any) -> Any:
        # An array's own shortcuts, which differ from np.power in the last digit.
        if isinstance(exponent, (int, float)) and exponent in (2, 0.5):
            return np.square(self) if exponent == 2 else np.sqrt(self)
        return np.power(self, exponent)

    def copy(self, order: str = "C") -> "TracedArray":
        """Return a copy, as an array does."""
        return TracedArray(functions.copy(self.program, self.array), self.program)

    def astype(self, kind: Any) -> "TracedArray":
        """Return a copy as float64.

        Raises:
            Untraceable: of another kind.
        """
        if np.dtype(kind) != float:
            raise Untraceable(f"astype({kind})")
        as_float = ufuncs.as_float(self.program, self.array)
        return TracedArray(functions.copy(self.program, as_float), self.program)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        """Return the method of that name; ``np.sum(x)`` is ``x.sum()``.

        Raises:
            Untraceable: arrays have it, and traced arrays do not.
            AttributeError: arrays do not have it.
        """
        if name in _METHODS:
            return lambda *args, **kwargs: getattr(np, name)(self, *args, **kwargs)
        if hasattr(np.ndarray, name) and not name.startswith("__"):
            raise Untraceable(f"an array's {name}")
        raise AttributeError(name)

    def _applied(self, operation: Callable[..., Any], *arguments: Any) -> Any:
        """Return what the ``operation`` of the program's arrays returns, traced."""
        returned = operation(self.program, *map(_plain, arguments))
        if isinstance(returned, tuple):
            return tuple(map(self._traced, returned))
        return self._traced(returned)

    def _traced(self, value: Any) -> Any:
        held = isinstance(value, np.ndarray) and self.program.holds(value)
        return TracedArray(value, self.program) if held else value

    def _number(self, *_: Any, **__: Any) -> NoReturn:
        raise Untraceable("a branch on a measured value, or a Python number made of one")

    __bool__ = __float__ = __int__ = __index__ = __complex__ = __round__ = __array__ = _number
    item = tolist = _number


def _refuse_traced(index: Any) -> None:
    """Refuse an index that is measured: where it points would be frozen."""
    parts = index if isinstance(index, tuple) else (index,)
    if any(isinstance(part, TracedArray) for part in parts):
        raise Untraceable("an index that is measured")


def _plain(value: Any) -> Any:
    """Return the ``value`` with its traced arrays, at any depth, as arrays of the memory."""
    if isinstance(value, TracedArray):
        return value.array
    if isinstance(value, (list, tuple)) and not hasattr(value, "_fields"):
        return type(value)(map(_plain, value))
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items()}
    return value
