"""Ufuncs on arrays of a program's memory: computed at once by NumPy, and taken down."""

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjspace.gufunc import gufunc
from mjspace.tracing.inner_loops import Untraceable
from mjspace.tracing.program import Program

_Array = NDArray[Any]
Result = _Array | tuple[_Array, ...]
_BOOL, _FLOAT = np.dtype(bool), np.dtype(float)
_MATMUL = "(n,k),(k,m)->(n,m)"


@gufunc(["void(b1[:], f8[:], f8[:], f8[:])"], "(n),(n),(n)->(n)")
def _select(condition: Any, yes: Any, no: Any, result: Any) -> None:
    for i in range(condition.size):
        result[i] = yes[i] if condition[i] else no[i]


@gufunc(["void(f8, f8, f8[:])"], "(),()->()")
def power_of_numbers(base: Any, exponent: Any, result: Any) -> None:
    """Compute ``base ** exponent`` as Python and NumPy's scalars do: by C's ``pow``."""
    result[0] = base**exponent


def apply(
    program: Program,
    ufunc: np.ufunc,
    method: str,
    inputs: tuple[Any, ...],
    options: dict[str, Any],
) -> Result:
    """Return what ``ufunc``, or its ``reduce``, makes of the ``inputs``: arrays of the memory.

    Raises:
        Untraceable: another method, or an option that cannot be taken down.
    """
    outputs = options.pop("out", None)
    if method == "reduce" and outputs is None:
        return reduce(program, ufunc, inputs[0], *inputs[1:], **options)
    if method != "__call__" or options:
        raise Untraceable(f"np.{ufunc.__name__}.{method} with {', '.join(options) or 'out'}")
    operands = _operands(program, ufunc, inputs)
    computed = ufunc(*operands)
    results = computed if isinstance(computed, tuple) else (computed,)
    targets = tuple(program.result(each) for each in results)
    if ufunc is np.matmul:
        _matmul(program, operands, targets[0])
    elif ufunc.signature:
        program.apply_core(ufunc, ufunc.signature, [*operands, *targets])
    else:
        program.apply(ufunc, [*operands, *targets])
    for output, target in zip(outputs or (), targets, strict=False):
        program.copy(target, output)
        output[...] = target
    if outputs is not None:
        targets = outputs
    return targets if len(targets) > 1 else targets[0]


def reduce(
    program: Program,
    ufunc: np.ufunc,
    array: _Array,
    axis: int | tuple[int, ...] | None = 0,
    *,
    keepdims: bool = False,
) -> _Array:
    """Return the reduction of an ``array`` of the memory along the ``axis``.

    NumPy calls the loop along the axis whose elements lie closest, whichever that is, and where it
    is reduced, the loop may add up pairwise.

    Raises:
        Untraceable: it has no loop over the array's type, or NumPy's order is not known.
    """
    named = range(array.ndim) if axis is None else axis if isinstance(axis, tuple) else (axis,)
    axes = sorted(each % array.ndim for each in named)
    if ufunc in (np.logical_or, np.logical_and) and array.dtype != _BOOL:
        array = apply(program, np.not_equal, "__call__", (array, 0.0), {})  # type: ignore[assignment]
    target = program.result(ufunc.reduce(array, axis=tuple(axes), keepdims=keepdims))
    result = target.squeeze(axis=tuple(axes)) if keepdims else target
    rows, along_rows = _rows(ufunc, array, axes)
    if ufunc.identity is None:
        program.copy(rows[..., 0], result)
        rows = rows[..., 1:]
    else:
        start = np.full(result.shape, ufunc.identity, result.dtype)
        program.copy(program.copied(start), result)
    if along_rows:
        program.reduce(ufunc, rows, result)
    else:
        for column in range(rows.shape[-1]):
            program.apply(ufunc, [result, rows[..., column], result])
    return target


def _rows(ufunc: np.ufunc, array: _Array, axes: list[int]) -> tuple[_Array, bool]:
    """Return the array with the reduced elements along a last axis, and whether a loop has them."""
    others = [axis for axis in range(array.ndim) if axis not in axes]
    if 0 in array.shape:
        return array.transpose(*others, *axes).reshape(*[array.shape[i] for i in others], 0), True
    moved = array.transpose(*others, *axes)
    steps = {axis: abs(array.strides[axis]) for axis in range(array.ndim) if array.shape[axis] > 1}
    reduced = [axis for axis in steps if axis in axes]
    along_rows = not reduced or min(steps[i] for i in reduced) == min(steps.values())
    one_run = all(
        array.strides[i] == array.strides[j] * array.shape[j] for i, j in pairwise(reduced)
    )
    if (len(reduced) > 1 and not (one_run and along_rows)) or 0 in steps.values():
        raise Untraceable(f"np.{ufunc.__name__}.reduce along {axes} of {array.strides}")
    lead = moved.shape[: len(others)]
    return moved.reshape(*lead, -1), along_rows


def select(program: Program, condition: Any, yes: Any, no: Any) -> _Array:
    """Return ``np.where(condition, yes, no)`` of floats in the memory."""
    computed = np.where(condition, yes, no)
    if computed.dtype != _FLOAT:
        raise Untraceable(f"np.where of {computed.dtype}")
    target = program.result(computed)
    if program.holds(condition) and condition.dtype != _BOOL:
        raise Untraceable("np.where on numbers")
    operands = [in_memory(program, condition, _BOOL)]
    operands += [in_memory(program, each, _FLOAT) for each in (yes, no)]
    shape = computed.shape or (1,)
    views = [np.broadcast_to(each, shape) for each in operands]
    program.apply_core(_select.ufunc, _select.ufunc.signature, [*views, target.reshape(shape)])
    return target


def as_float(program: Program, array: _Array) -> _Array:
    """Return an array of the memory as float64."""
    return array if array.dtype == _FLOAT else select(program, array, 1.0, 0.0)


def in_memory(program: Program, value: Any, kind: np.dtype[Any]) -> _Array:
    """Return the ``value`` as array of the memory and of that ``kind``, a constant copied to it.

    Raises:
        Untraceable: a constant that float64 cannot hold, or numbers of the memory as booleans.
    """
    array = np.asarray(value)
    if not program.holds(array):
        return program.copied(array.astype(bool) if kind == _BOOL else array)
    if array.dtype == kind:
        return array
    if kind == _FLOAT:
        return as_float(program, array)
    raise Untraceable("numbers as booleans")


def _operands(program: Program, ufunc: np.ufunc, inputs: tuple[Any, ...]) -> list[_Array]:
    """Return the ``inputs`` in the memory, of the types that the ufunc's loop takes."""
    kinds: list[Any] = [type(v) if type(v) in (int, float) else np.asarray(v).dtype for v in inputs]
    resolved = ufunc.resolve_dtypes((*kinds, *[None] * ufunc.nout))
    for kind in resolved:
        if kind not in (_BOOL, _FLOAT):
            raise Untraceable(f"np.{ufunc.__name__} of {kind}")
    return [in_memory(program, v, kind) for v, kind in zip(inputs, resolved, strict=False)]


def _matmul(program: Program, operands: list[_Array], target: _Array) -> None:
    """Take down a product of matrices, with vectors as matrices of one row or column."""
    left, right = operands
    if right.ndim == 1:
        right, target = right[:, None], target[..., None]
    if left.ndim == 1:
        left, target = left[None], target[..., None, :]
    program.apply_core(np.matmul, _MATMUL, [left, right, target])
