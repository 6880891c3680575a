"""Running a program without Python: compiled functions that call its inner loops by address."""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from mjspace.tracing.inner_loops import Untraceable
from mjspace.tracing.program import Calls

_BYTE, _WORD = ir.IntType(8), ir.IntType(64)
_POINTER = _BYTE.as_pointer()
_intrinsic: Any = intrinsic  # whose own type leaves out that numba passes the context


@_intrinsic
def call_loop(
    context: Any, loop: Any, operands: Any, dimensions: Any, steps: Any, data: Any
) -> Any:
    """Call ``void loop(char** operands, npy_intp* dimensions, npy_intp* steps, void* data)``."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(ir.VoidType(), [_POINTER] * 4)
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        builder.call(function, [builder.inttoptr(each, _POINTER) for each in arguments[1:]])
        return context.get_dummy_value()

    return types.void(*[types.int64] * 5), generate


@_intrinsic
def copy_bytes(context: Any, target: Any, source: Any, size: Any) -> Any:
    """Copy ``size`` bytes between addresses that do not overlap."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        function = builder.module.declare_intrinsic("llvm.memcpy", [_POINTER, _POINTER, _WORD])
        target, source = (builder.inttoptr(each, _POINTER) for each in arguments[:2])
        builder.call(function, [target, source, arguments[2], ir.Constant(ir.IntType(1), 0)])
        return context.get_dummy_value()

    return types.void(*[types.int64] * 3), generate


@njit
def address_of(array: Any) -> Any:
    """Return where the ``array`` begins; signed, since NumPy adds a mixed sum up as floats."""
    return np.int64(array.ctypes.data)


@njit("int64[::1](int64[::1], int64[::1], int64)", cache=True)
def placed(words: Any, relative: Any, base: int) -> Any:
    """Return the ``words`` of a program whose memory begins at the address ``base``."""
    return words + relative * base


@njit("void(int64[:, ::1], int64[::1])", cache=True)
def run(table: Any, words: Any) -> None:
    """Call the loops of the ``table``, whose ``words`` have been placed."""
    base = address_of(words)
    for c in range(len(table)):
        operands, dimensions, steps = table[c, 2], table[c, 3], table[c, 4]
        call_loop(
            table[c, 0], base + 8 * operands, base + 8 * dimensions, base + 8 * steps, table[c, 1]
        )


def prove(calls: Calls, memory: NDArray[Any]) -> None:
    """Run the ``calls`` on a copy of the ``memory`` in which they were taken down.

    Raises:
        Untraceable: they do not compute, bit by bit, what NumPy did.
    """
    again = memory.copy()
    run(calls.table, placed(calls.words, calls.relative, again.ctypes.data))
    if again.tobytes() != memory.tobytes():
        raise Untraceable("the calls of NumPy's loops do not repeat what NumPy computed")
