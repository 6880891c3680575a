"""MuJoCo's C functions as compiled code calls them, by their addresses."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_POINTER, _INT = ir.IntType(8).as_pointer(), ir.IntType(32)
_intrinsic: Any = intrinsic  # whose own type leaves out that numba passes the context


def _call(builder: Any, address: Any, pointers: Any, *others: Any) -> Any:
    """Call the C function at an ``address`` with pointers and what follows them."""
    kind = ir.FunctionType(ir.VoidType(), [_POINTER] * len(pointers) + [o.type for o in others])
    function = builder.inttoptr(address, kind.as_pointer())
    return builder.call(function, [*(builder.inttoptr(p, _POINTER) for p in pointers), *others])


@_intrinsic
def of_model_and_data(context: Any, function: Any, model: Any, data: Any) -> Any:
    """Call ``mj_step``, ``mj_step1``, ``mj_forward`` or ``mj_setConst``."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _call(builder, arguments[0], arguments[1:])
        return context.get_dummy_value()

    return types.void(*[types.int64] * 3), generate


@_intrinsic
def with_state(context: Any, function: Any, model: Any, data: Any, row: Any, state: Any) -> Any:
    """Call ``mj_getState`` or ``mj_setState``."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _call(builder, arguments[0], arguments[1:4], builder.trunc(arguments[4], _INT))
        return context.get_dummy_value()

    return types.void(*[types.int64] * 5), generate


@_intrinsic
def address(context: Any, memory: Any) -> Any:
    """Return a pointer as a number."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.ptrtoint(arguments[0], ir.IntType(64))

    return types.int64(types.voidptr), generate
