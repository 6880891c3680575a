"""NumPy's functions on arrays of a program's memory, besides ufuncs."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjspace.tracing import ufuncs
from mjspace.tracing.inner_loops import Untraceable
from mjspace.tracing.program import Program

_Array = NDArray[Any]
_BOOL, _FLOAT = np.dtype(bool), np.dtype(float)
_clip: np.ufunc = np._core.umath.clip  # type: ignore[attr-defined]


def apply(program: Program, function: Any, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    """Return what NumPy's ``function`` returns: arrays of the memory, or plain Python numbers.

    Raises:
        Untraceable: it is not among the functions that can be taken down.
    """
    name = f"np.{function.__name__}"
    try:
        if function in MOVES:
            data, *others = args
            _refuse_arrays(program, name, others, kwargs)
            return move(program, lambda array: function(array, *others, **kwargs), data)
        if function in _REDUCTIONS:
            _refuse_arrays(program, name, args[1:], kwargs)
            return _reduced(program, _REDUCTIONS[function], *args, **kwargs)
        if function in _ABOUT_SHAPES:
            return function(*(_shape_of(each) for each in args), **kwargs)
        if function in _OWN:
            return _OWN[function](program, *args, **kwargs)
    except TypeError as error:
        raise Untraceable(f"{name}: {error}") from error
    raise Untraceable(name)


def move(program: Program, function: Callable[[Any], np.ndarray], data: Any) -> _Array:
    """Return what ``function`` makes of ``data``, an array or several, by moving elements alone.

    A view stays one. Else it is applied to the elements' places to see where each comes from.
    """
    several = isinstance(data, (list, tuple))
    arrays = [np.asarray(each) for each in (data if several else [data])]
    kind = np.result_type(*arrays)
    if kind not in (_BOOL, _FLOAT):
        raise Untraceable(f"an array of {kind}")
    held = [ufuncs.in_memory(program, each, kind) for each in arrays]
    result = function(held if several else held[0])
    if isinstance(result, np.ndarray) and program.holds(result):
        return result if result.ndim or result.flags.writeable else _array_of(program, result)
    places = [_places(program, each) for each in held]
    sources = np.asarray(function(places if several else places[0]))
    target = program.result(result)
    by_stride = np.argsort([-step for step in target.strides], kind="stable")
    _gather(program, *(each.transpose(by_stride).reshape(-1) for each in (sources, target)))
    return target


def _array_of(program: Program, number: _Array) -> _Array:
    """Return an array of no dimensions, which nothing takes for a number."""
    target = program.copied(number)
    program.copy(number, target)
    return target


def copy(program: Program, array: _Array) -> _Array:
    """Return a contiguous copy of an array of the memory."""
    target = program.copied(array)
    target.setflags(write=array.flags.writeable or array.ndim > 0)  # of a number, a number
    program.copy(array, target)
    return target


def assign(program: Program, array: _Array, index: Any, value: Any) -> None:
    """Take down ``array[index] = value``.

    Raises:
        Untraceable: the index picks elements one by one.
    """
    target = array[index]
    if not isinstance(target, np.ndarray):
        target = array[(*index, ...) if isinstance(index, tuple) else (index, ...)]
    if not program.holds(target):
        raise Untraceable("an assignment to elements one by one")
    source = ufuncs.in_memory(program, value, target.dtype)
    if np.may_share_memory(source, target):
        source = copy(program, source)
    array[index] = value  # may raise what it raises
    lost = range(source.ndim - target.ndim)  # NumPy drops leading axes of length 1
    program.copy(np.broadcast_to(source.squeeze(axis=tuple(lost)), target.shape), target)


def _places(program: Program, array: _Array) -> _Array:
    """Return the offset of each element [bytes]."""
    places = np.full(array.shape, program.offset(array))
    for axis, (length, stride) in enumerate(zip(array.shape, array.strides, strict=True)):
        along = [1] * array.ndim
        along[axis] = length
        places += np.arange(length).reshape(along) * stride
    return places


def _gather(program: Program, sources: _Array, target: _Array) -> None:
    """Take down copies of the elements at ``sources`` [bytes] to ``target``, (n,)."""
    first = 0
    while first < len(sources):
        end = first + 1
        step = sources[end] - sources[first] if end < len(sources) else 0
        while end < len(sources) and sources[end] - sources[end - 1] == step:
            end += 1
        length = end - first
        source = program.at(int(sources[first]), (length,), (int(step),), target.dtype)
        program.copy(source, target[first:end])
        first = end


def _reduced(
    program: Program,
    ufunc: np.ufunc,
    array: _Array,
    axis: int | tuple[int, ...] | None = None,
    *,
    keepdims: bool = False,
) -> _Array:
    return ufuncs.reduce(program, ufunc, array, axis, keepdims=keepdims)


def _call(program: Program, ufunc: np.ufunc, *inputs: Any) -> Any:
    return ufuncs.apply(program, ufunc, "__call__", inputs, {})


def _clipped(program: Program, array: Any, low: Any = None, high: Any = None) -> Any:
    if low is None or high is None:
        one_sided = np.minimum if low is None else np.maximum
        return _call(program, one_sided, array, high if low is None else low)
    return _call(program, _clip, array, low, high)


def _norm(
    program: Program,
    array: _Array,
    order: None = None,
    axis: int | None = None,
    keepdims: bool = False,
) -> Any:
    if order is not None or (axis is None and array.ndim != 1):
        raise Untraceable("np.linalg.norm with an order, or without an axis")
    array = ufuncs.as_float(program, array)
    if axis is None and not keepdims:
        return _call(program, np.sqrt, _call(program, np.matmul, array, array))
    squares = _call(program, np.multiply, array, array)
    return _call(program, np.sqrt, ufuncs.reduce(program, np.add, squares, axis, keepdims=keepdims))


def _cross(program: Program, a: Any, b: Any) -> Any:
    # As NumPy computes it, component by component, along the last axis.
    (a0, a1, a2), (b0, b1, b2) = (
        [move(program, lambda each, k=k: each[..., k], vector) for k in range(3)]  # type: ignore[misc]
        for vector in map(np.asarray, (a, b))
    )
    products = [(a1, b2, a2, b1), (a2, b0, a0, b2), (a0, b1, a1, b0)]
    components = [
        _call(
            program,
            np.subtract,
            _call(program, np.multiply, plus, by),
            _call(program, np.multiply, minus, times),
        )
        for plus, by, minus, times in products
    ]
    shape = np.broadcast_shapes(*(each.shape for each in components))
    whole = [move(program, lambda each: np.broadcast_to(each, shape), c) for c in components]
    return move(program, lambda arrays: np.stack(arrays, axis=-1), whole)


def _dot(program: Program, a: Any, b: Any) -> Any:
    if np.ndim(a) == 0 or np.ndim(b) == 0:
        return _call(program, np.multiply, a, b)
    if np.ndim(a) > 1 or np.ndim(b) > 1:
        raise Untraceable("np.dot of matrices, which may round unlike np.matmul: that can be")
    product = _call(program, np.matmul, a, b)
    if np.asarray(np.dot(a, b)).tobytes() != product.tobytes():
        raise Untraceable("np.dot, which rounds unlike np.matmul here")
    return product


def _outer(program: Program, a: Any, b: Any) -> Any:
    column, row = (move(program, np.ravel, each) for each in (a, b))
    return _call(program, np.multiply, column[:, None], row[None, :])


def _mean(program: Program, array: _Array, axis: Any = None, *, keepdims: bool = False) -> Any:
    array = ufuncs.as_float(program, array)
    total = _reduced(program, np.add, array, axis, keepdims=keepdims)
    return _call(program, np.true_divide, total, array.size / max(total.size, 1))


def _sinc(program: Program, array: Any) -> Any:
    # As NumPy computes it.
    x = _call(program, np.multiply, np.pi, array)
    zero = _call(program, np.equal, x, 0.0)
    y = ufuncs.select(program, zero, np.finfo(float).eps, x)
    return _call(program, np.true_divide, _call(program, np.sin, y), y)


def _where(program: Program, condition: Any, *choices: Any) -> _Array:
    if len(choices) != 2:
        raise Untraceable("np.where with a condition alone")
    return ufuncs.select(program, np.asarray(condition), *choices)


def _full_like(program: Program, array: Any, value: Any, dtype: Any = None) -> _Array:
    target = program.result(np.full_like(array, value, dtype=dtype))
    source = ufuncs.in_memory(program, value, target.dtype)
    program.copy(np.broadcast_to(source, target.shape), target)  # in each run: it may be written to
    return target


def _refuse_arrays(
    program: Program, name: str, others: Sequence[Any], options: dict[str, Any]
) -> None:
    """Refuse a measured option, which would be frozen, and results of other kinds or elsewhere."""
    arrays = [e for e in (*others, *options.values()) if isinstance(e, np.ndarray)]
    if any(program.holds(each) or each.dtype.kind not in "iub" for each in arrays):
        raise Untraceable(f"{name} with a measured option")
    if {"out", "dtype", "casting"} & options.keys() or (
        name in ("np.atleast_1d", "np.atleast_2d") and others
    ):
        raise Untraceable(f"{name} with such options")


def _shape_of(value: Any) -> Any:
    """Return an array of the same shape, all that functions of shapes need."""
    return np.broadcast_to(0.0, value.shape) if isinstance(value, np.ndarray) else value


MOVES: frozenset[Any] = frozenset({
    np.atleast_1d, np.atleast_2d, np.broadcast_to, np.column_stack, np.concatenate, np.copy,
    np.diagonal, np.expand_dims, np.flip, np.hstack, np.moveaxis, np.ravel, np.repeat, np.reshape,
    np.roll, np.squeeze, np.stack, np.swapaxes, np.take, np.tile, np.transpose, np.vstack,
})  # fmt: skip
"""Functions that move elements of their first argument, and compute nothing."""
_REDUCTIONS: dict[Any, np.ufunc] = {
    np.all: np.logical_and,
    np.any: np.logical_or,
    np.max: np.maximum,
    np.min: np.minimum,
    np.prod: np.multiply,
    np.sum: np.add,
}
_ABOUT_SHAPES: frozenset[Any] = frozenset({np.ndim, np.shape, np.size})
_OWN: dict[Any, Callable[..., Any]] = {
    np.clip: _clipped,
    np.cross: _cross,
    np.dot: _dot,
    np.empty_like: lambda program, array, **options: _full_like(program, array, 0.0, **options),
    np.full_like: _full_like,
    np.linalg.norm: _norm,
    np.mean: _mean,
    np.outer: _outer,
    np.ones_like: lambda program, array, **options: _full_like(program, array, 1.0, **options),
    np.sinc: _sinc,
    np.where: _where,
    np.zeros_like: lambda program, array, **options: _full_like(program, array, 0.0, **options),
}
