"""Ufuncs on arrays of a program's memory: computed at once by NumPy, and taken down."""

from typing import Any

import numpy as np

from mjspace.gufunc import gufunc
from mjspace.tracing.inner_loops import Untraceable
from mjspace.tracing.program import Program

Result = np.ndarray | tuple[np.ndarray, ...]
_BOOL, _FLOAT = np.dtype(bool), np.dtype(float)
_MATMUL = "(n,k),(k,m)->(n,m)"


@gufunc(["void(b1[:], f8[:], f8[:], f8[:])"], "(n),(n),(n)->(n)")
def _select(condition: Any, yes: Any, no: Any, result: Any) -> None:
    for i in range(condition.size):
        result[i] = yes[i] if condition[i] else no[i]


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
    targets = tuple(program.copied(result) for result in results)
    if ufunc is np.matmul:
        _matmul(program, operands, targets[0])
    elif ufunc.signature:
        program.apply_core(ufunc, ufunc.signature, [*operands, *targets])
    else:
        program.apply(ufunc, [*operands, *targets])
    for output, target in zip(outputs or (), targets, strict=False):
        output[...] = target
        program.copy(target, output)
    if outputs is not None:
        targets = outputs
    return targets if len(targets) > 1 else targets[0]


def reduce(
    program: Program,
    ufunc: np.ufunc,
    array: np.ndarray,
    axis: int | tuple[int, ...] | None = 0,
    dtype: None = None,
    out: None = None,
    keepdims: bool = False,
) -> np.ndarray:
    """Return the reduction of an ``array`` of the memory along the ``axis``.

    Raises:
        Untraceable: the ufunc has no loop over the array's type.
    """
    given = range(array.ndim) if axis is None else axis if isinstance(axis, tuple) else (axis,)
    axes = sorted(each % array.ndim for each in given)
    if ufunc in (np.logical_or, np.logical_and) and array.dtype != _BOOL:
        array = apply(program, np.not_equal, "__call__", (array, 0.0), {})  # type: ignore[assignment]
    target = program.copied(ufunc.reduce(array, axis=tuple(axes), keepdims=keepdims))
    lead = array.shape[: axes[0]]
    if axes == list(range(axes[0], array.ndim)) and (len(axes) == 1 or array.flags.c_contiguous):
        rows, along_rows = array.reshape(*lead, -1), True
    elif len(axes) == 1:
        rows, along_rows = np.moveaxis(array, axes[0], -1), False
    else:
        raise Untraceable(f"np.{ufunc.__name__}.reduce along the axes {axes}")
    result = target.reshape(rows.shape[:-1])
    if ufunc.identity is None:
        program.copy(rows[..., :1].reshape(result.shape), result)
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


def select(program: Program, condition: Any, yes: Any, no: Any) -> np.ndarray:
    """Return ``np.where(condition, yes, no)`` as floats in the memory."""
    computed = np.where(condition, yes, no)
    if computed.dtype == _BOOL:
        raise Untraceable("np.where of booleans")
    target = program.copied(computed)
    chosen = condition if condition.dtype == _BOOL else condition != 0.0
    if program.holds(condition) and condition.dtype != _BOOL:
        raise Untraceable("np.where on numbers")
    operands = [in_memory(program, chosen, _BOOL)]
    operands += [in_memory(program, each, _FLOAT) for each in (yes, no)]
    shape = computed.shape or (1,)
    views = [np.broadcast_to(each, shape) for each in operands]
    program.apply_core(_select.ufunc, _select.ufunc.signature, [*views, target.reshape(shape)])
    return target


def as_float(program: Program, array: np.ndarray) -> np.ndarray:
    """Return an array of the memory as float64."""
    return array if array.dtype == _FLOAT else select(program, array, 1.0, 0.0)


def in_memory(program: Program, value: Any, kind: np.dtype[Any]) -> np.ndarray:
    """Return the ``value`` as array of the memory and of that ``kind``, a constant copied to it."""
    array = np.asarray(value)
    if not program.holds(array):
        return program.copied(array.astype(kind))
    if array.dtype == kind:
        return array
    if kind == _FLOAT:
        return as_float(program, array)
    raise Untraceable("numbers as booleans")


def _operands(program: Program, ufunc: np.ufunc, inputs: tuple[Any, ...]) -> list[np.ndarray]:
    """Return the ``inputs`` in the memory, of the types that the ufunc's loop takes."""
    if ufunc.signature:
        return [in_memory(program, each, _FLOAT) for each in inputs]
    kinds: list[Any] = [type(v) if type(v) in (int, float) else np.asarray(v).dtype for v in inputs]
    resolved = ufunc.resolve_dtypes((*kinds, *[None] * ufunc.nout))
    for kind in resolved:
        if kind not in (_BOOL, _FLOAT):
            raise Untraceable(f"np.{ufunc.__name__} of {kind}")
    return [in_memory(program, v, kind) for v, kind in zip(inputs, resolved, strict=False)]


def _matmul(program: Program, operands: list[np.ndarray], target: np.ndarray) -> None:
    """Take down a product of matrices, with vectors as matrices of one row or column."""
    left, right = operands
    if left.ndim == 1:
        left, target = left[None], target[..., None, :]
    if right.ndim == 1:
        right, target = right[:, None], target[..., None]
    program.apply_core(np.matmul, _MATMUL, [left, right, target])
