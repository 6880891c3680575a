"""An array whose use is taken down in a program.

It is no ``np.ndarray``, so that nothing can turn it into numbers unnoticed: what would freeze its
present values, as a branch on one does, or ``float``, or ``np.asarray``, raises ``Untraceable``.
"""

from collections.abc import Callable, Iterator
from typing import Any, NoReturn

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

from mjspace.tracing import functions, ufuncs
from mjspace.tracing.program import Program

_METHODS = (
    *("all", "any", "clip", "max", "mean", "min", "prod", "ravel", "repeat", "reshape", "squeeze"),
    *("sum", "swapaxes", "take", "transpose", "diagonal"),
)
"""Methods of arrays that are functions of NumPy as well."""


class TracedArray(NDArrayOperatorsMixin):
    """An array of a program's memory, as the code that is taken down receives it.

    One of no dimensions that cannot be written to stands for a number, as NumPy makes of sums and
    of elements: operators in place make another of it, and powers are those of C.
    """

    __slots__ = ("array", "program")

    def __init__(self, array: NDArray[Any], program: Program) -> None:
        self.array, self.program = array, program

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        if ufunc is np.power and self._is_number and issubclass(type(inputs[0]), np.generic):
            self._refused("a power of one of NumPy's numbers, or np.power of it")
        outputs = options.get("out", ())
        if any(isinstance(each, TracedArray) and each._is_number for each in outputs):
            del options["out"]
        elif outputs:
            options["out"] = tuple(map(self._plain, outputs))
        return self._applied(ufuncs.apply, ufunc, method, tuple(map(self._plain, inputs)), options)

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        moves = function in functions.MOVES
        first = map(self._plain_or_several if moves else self._plain, args[:1])
        others = tuple(map(self._plain, args[1:]))
        options = {name: self._plain(each) for name, each in kwargs.items()}
        return self._applied(functions.apply, function, (*first, *others), options)

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
        return self._traced(self.array.T)  # type: ignore[no-any-return]

    def __len__(self) -> int:
        return len(self.array)

    def __iter__(self) -> Iterator[Any]:
        return (self[index] for index in range(len(self)))

    def __getitem__(self, index: Any) -> Any:
        self._refuse_traced(index)
        return self._applied(functions.move, lambda array: array[index], self.array)

    def __setitem__(self, index: Any, value: Any) -> None:
        self._refuse_traced(index)
        self._applied(functions.assign, self.array, index, self._plain(value))

    def __pow__(self, exponent: Any) -> Any:
        if self._is_number and _is_number(exponent):
            return ufuncs.power_of_numbers.ufunc(self, exponent)
        if self._is_number and isinstance(exponent, np.generic):
            self._refused("a power of a number whose exponent is one of NumPy's integers")
        if isinstance(exponent, TracedArray):
            return np.power(self, exponent)
        # An array's own shortcuts, such as np.square, differ from np.power in the last digit.
        ufunc, others = np.zeros(self.shape).view(_Asked) ** exponent
        return ufunc(self, *others)

    def __rpow__(self, base: Any) -> Any:
        of_numbers = self._is_number and _is_number(base)
        return ufuncs.power_of_numbers.ufunc(base, self) if of_numbers else np.power(base, self)

    def __ipow__(self, exponent: Any) -> Any:
        powers = self**exponent
        if self._is_number:
            return powers
        self[...] = powers
        return self

    def copy(self, order: str = "C") -> "TracedArray":
        """Return a copy, as an array does."""
        if order != "C":
            self._refused(f"a copy in the order {order}")
        return self._applied(functions.copy, self.array)  # type: ignore[no-any-return]

    def __copy__(self) -> "TracedArray":
        return self.copy()

    def __deepcopy__(self, memo: Any) -> "TracedArray":
        return self.copy()

    def reshape(self, *shape: Any, **options: Any) -> Any:
        """Return ``np.reshape`` of it; the shape may be several arguments, as of an array."""
        return np.reshape(self, shape[0] if len(shape) == 1 else shape, **options)

    def transpose(self, *axes: Any) -> Any:
        """Return ``np.transpose`` of it; the axes may be several arguments, as of an array."""
        return np.transpose(self, axes[0] if len(axes) == 1 else axes or None)

    def astype(self, kind: Any) -> "TracedArray":
        """Return a copy as float64.

        Raises:
            Untraceable: of another kind.
        """
        if np.dtype(kind) != float:
            self._refused(f"astype({kind})")
        if self._is_number and self.array.dtype != float:
            as_number: Any = np.add(self, 0.0)
            return as_number  # type: ignore[no-any-return]
        as_float: TracedArray = self._applied(ufuncs.as_float, self.array)
        return as_float.copy()

    def __getattr__(self, name: str) -> Callable[..., Any]:
        """Return the method of that name; ``np.sum(x)`` is ``x.sum()``.

        Raises:
            Untraceable: arrays have it, and traced arrays do not.
            AttributeError: arrays do not have it.
        """
        if name in _METHODS:
            return lambda *args, **kwargs: getattr(np, name)(self, *args, **kwargs)
        if hasattr(np.ndarray, name) and not name.startswith("__"):
            self._refused(f"an array's {name}")
        raise AttributeError(name)

    def _applied(self, operation: Callable[..., Any], *arguments: Any) -> Any:
        """Return what the ``operation`` of the program's arrays returns, traced."""
        try:
            returned = operation(self.program, *arguments)
        except Exception as error:
            self.program.failed(error)
            raise
        if isinstance(returned, tuple):
            return tuple(map(self._traced, returned))
        return self._traced(returned)

    def _traced(self, value: Any) -> Any:
        held = isinstance(value, np.ndarray) and self.program.holds(value)
        return TracedArray(value, self.program) if held else value

    def _plain(self, value: Any) -> Any:
        """Return the array of the memory that the ``value`` is, or the value that it is."""
        if not isinstance(value, TracedArray):
            return value
        if value.program is not self.program:
            self._refused("an array kept from an earlier call")
        return value.array

    def _plain_or_several(self, value: Any) -> Any:
        """Return ``_plain`` of it, or of each value in a list, such as that of ``np.stack``."""
        if isinstance(value, TracedArray) or not isinstance(value, (list, tuple)):
            return self._plain(value)
        return list(map(self._plain, value))

    @property
    def _is_number(self) -> bool:
        return not self.array.ndim and not self.array.flags.writeable

    def _refuse_traced(self, index: Any) -> None:
        """Refuse an index that is measured: where it points would be frozen."""
        parts = index if isinstance(index, tuple) else (index,)
        if any(isinstance(part, TracedArray) for part in parts):
            self._refused("an index that is measured")

    def _refused(self, reason: str) -> NoReturn:
        self.program.refuse(reason)

    def _in_branch(self, *_: Any) -> NoReturn:
        self._refused("a branch on a measured value")

    def _as_python(self, *_: Any, **__: Any) -> NoReturn:
        self._refused("a Python number, or text, made of a measured value")

    def _as_array(self, *_: Any, **__: Any) -> NoReturn:
        self._refused("a NumPy array made of measured values, as np.array does: np.stack can be")

    def _stands_for(self) -> type:
        """Return the class that ``isinstance`` is to see, that of the flight's array or number."""
        return type(self.array[()]) if self._is_number else np.ndarray

    __bool__ = _in_branch
    __float__ = __int__ = __index__ = __complex__ = __round__ = item = tolist = _as_python
    __str__ = __format__ = __reduce_ex__ = _as_python
    __array__ = _as_array
    __class__ = property(_stands_for)


class _Asked(np.ndarray):
    """An array that tells which ufunc NumPy calls on it, and with what else."""

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        return ufunc, inputs[1:]


def _is_number(value: Any) -> bool:
    if isinstance(value, TracedArray):
        return value._is_number
    return isinstance(value, (int, float))
