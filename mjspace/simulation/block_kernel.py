"""The compiled function that flies one vehicle through a block of control periods.

It knows no law and no vehicle: its orders say which loops to call on a program's memory, and what
to copy between that memory, MuJoCo and the block's records.
"""

import functools
import hashlib
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import ir
from numba import cfunc, from_dtype, njit, types
from numba.extending import intrinsic
from numba.np.numpy_support import carray

from mjspace.environment import native_memory
from mjspace.environment.native_memory import pointer
from mjspace.tracing import replay
from mjspace.tracing.replay import address_of, copy_bytes, placed, run

_NUMBER, _TABLE = np.int64, (np.int64, (2,))  # a table: its address, its rows
ORDERS = np.dtype([
    # MuJoCo's functions, and the state that mj_getState gets
    ("step", _NUMBER), ("forward", _NUMBER), ("get_state", _NUMBER), ("state", _NUMBER),
    # numbers of the block's first period, of its periods, and of the flight's last, not flown
    ("first", _NUMBER), ("count", _NUMBER), ("last", _NUMBER),
    # where the number of a signal stands that ends the block, and each vehicle's whole periods
    ("received", _NUMBER), ("whole", _NUMBER),
    # integration steps of a period; 1 where the actuators act in each of them
    ("steps", _NUMBER), ("stepwise", _NUMBER),
    # control period and integration step [s]
    ("control", np.float64), ("physics", np.float64),
    # the program: its memory, its calls' words and which are offsets in the memory, and the calls
    # of a control instant and of the actuators
    ("memory", *_TABLE), ("words", *_TABLE), ("relative", *_TABLE),
    ("sensing", *_TABLE), ("driving", *_TABLE),
    # into the memory at a control instant: (to, address, strides of periods and vehicles, size)
    ("inputs", *_TABLE),
    # what a vehicle remembers from block to block: (in the memory, in the vehicle's row, size)
    ("remembered", *_TABLE), ("row", _NUMBER), ("row_stride", _NUMBER),
    # within the memory, after either section: (to, from, size)
    ("after_sensing", *_TABLE), ("after_driving", *_TABLE),
    # into MuJoCo's arrays: (word of mjData that points there, offset, from, size)
    ("applied", *_TABLE),
    # recorded before and after the first integration step: (in the record, from, size)
    ("before", *_TABLE), ("after", *_TABLE),
    ("record", _NUMBER), ("period_stride", _NUMBER), ("vehicle_stride", _NUMBER),
    # in the memory: the time [s], the state row, the motors that saturate
    ("time", _NUMBER), ("state_row", _NUMBER), ("saturated", *_TABLE),
    ("saturated_record", _NUMBER),
    # MuJoCo's sensors: in the memory, word of mjData, size
    ("sensors", _NUMBER), ("sensors_word", _NUMBER), ("sensors_size", _NUMBER),
])  # fmt: skip
"""What is flown; places in a memory are offsets [bytes], sizes are in bytes."""
_ORDERS = from_dtype(ORDERS)
_POINTER, _INT = ir.IntType(8).as_pointer(), ir.IntType(32)
_MOST_WORDS = 1 << 20
"""More than mjData has: only words that ``applied`` and ``sensors_word`` name are read."""
_intrinsic: Any = intrinsic  # whose own type leaves out that numba passes the context


def _call(builder: Any, address: Any, pointers: Any, *others: Any) -> Any:
    """Call the C function at an ``address`` with pointers and what follows them."""
    kind = ir.FunctionType(ir.VoidType(), [_POINTER] * len(pointers) + [o.type for o in others])
    function = builder.inttoptr(address, kind.as_pointer())
    return builder.call(function, [*(builder.inttoptr(p, _POINTER) for p in pointers), *others])


@_intrinsic
def _step(context: Any, function: Any, model: Any, data: Any) -> Any:
    """Call ``mj_step`` or ``mj_forward``."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _call(builder, arguments[0], arguments[1:])
        return context.get_dummy_value()

    return types.void(*[types.int64] * 3), generate


@_intrinsic
def _get_state(context: Any, function: Any, model: Any, data: Any, row: Any, state: Any) -> Any:
    """Call ``mj_getState``."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _call(builder, arguments[0], arguments[1:4], builder.trunc(arguments[4], _INT))
        return context.get_dummy_value()

    return types.void(*[types.int64] * 5), generate


@_intrinsic
def _address(context: Any, memory: Any) -> Any:
    """Return a pointer as a number."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.ptrtoint(arguments[0], ir.IntType(64))

    return types.int64(types.voidptr), generate


@njit
def _table(where: Any, columns: int) -> Any:
    return carray(pointer(where[0]), (where[1], columns), np.int64)


@njit
def _words(where: Any) -> Any:
    return carray(pointer(where[0]), (where[1],), np.int64)


@njit
def _copy(target: int, source: int, table: Any) -> None:
    """Copy what the rows (to, from, size) of the ``table`` say."""
    for i in range(len(table)):
        copy_bytes(target + table[i, 0], source + table[i, 1], table[i, 2])


@njit
def _fly(
    orders: Any, memory: Any, words: Any, model: int, data: int, fields: Any, vehicle: int
) -> Any:
    """Fly a block on a ``memory`` and the ``words`` placed there, which the caller keeps alive.

    Return the number of its whole periods: all, unless a signal is received.
    """
    base = address_of(memory)
    sensing, driving = _table(orders.sensing, 5), _table(orders.driving, 5)
    inputs, remembered = _table(orders.inputs, 5), _table(orders.remembered, 3)
    after_sensing, after_driving = _table(orders.after_sensing, 3), _table(orders.after_driving, 3)
    before, after = _table(orders.before, 3), _table(orders.after, 3)
    applied = _table(orders.applied, 4)
    time = carray(pointer(base + orders.time), (1,), np.float64)
    received = carray(pointer(orders.received), (1,), np.int64)
    motors = orders.saturated[1]
    saturated = carray(pointer(base + orders.saturated[0]), (motors,), np.float64)
    row = orders.row + vehicle * orders.row_stride
    _copy(base, row, remembered)
    for k in range(orders.count):
        number = orders.first + k
        flown = number < orders.last
        record = orders.record + k * orders.period_stride + vehicle * orders.vehicle_stride
        ever = carray(pointer(record + orders.saturated_record), (motors,), np.float64)
        ever[:] = 0.0
        time[0] = number * orders.control
        _get_state(orders.get_state, model, data, base + orders.state_row, orders.state)
        for i in range(len(inputs)):
            source = inputs[i, 1] + k * inputs[i, 2] + vehicle * inputs[i, 3]
            copy_bytes(base + inputs[i, 0], source, inputs[i, 4])
        run(sensing, words)
        _copy(record, base, before)
        _copy(base, base, after_sensing)
        for step in range(orders.steps if flown else 1):
            if received[0] != 0:
                return k
            acting = step == 0 or orders.stepwise != 0
            if acting:
                if step:
                    time[0] = (number * orders.steps + step) * orders.physics
                    _get_state(orders.get_state, model, data, base + orders.state_row, orders.state)
                run(driving, words)
                for i in range(len(applied)):
                    target = fields[applied[i, 0]] + applied[i, 1]
                    copy_bytes(target, base + applied[i, 2], applied[i, 3])
                for i in range(motors):
                    ever[i] = max(ever[i], saturated[i])
            _step(orders.step if flown else orders.forward, model, data)
            if step == 0:
                copy_bytes(base + orders.sensors, fields[orders.sensors_word], orders.sensors_size)
                _copy(record, base, after)
            if acting:
                _copy(base, base, after_driving)
    for i in range(len(remembered)):
        copy_bytes(row + remembered[i, 1], base + remembered[i, 0], remembered[i, 2])
    return orders.count


@functools.cache
def block_function() -> Any:
    """Return the C function that flies a block: an ``mjfBatchFunc`` whose argument is ``ORDERS``.

    numba's cache of machine code notices changes of this file alone; those of the others that it is
    compiled from make another ``version``, which is part of the cache's key.
    """
    files = (native_memory.__file__, replay.__file__)
    digest = hashlib.sha256(b"".join(Path(file).read_bytes() for file in files)).digest()
    return _compiled(int.from_bytes(digest[:7]) | 1)


def _compiled(version: int) -> Any:
    @cfunc(
        types.void(types.voidptr, types.voidptr, types.int32, types.CPointer(_ORDERS)),
        cache=True,
        error_model="numpy",
    )
    def fly(model: Any, data: Any, vehicle: int, argument: Any) -> None:
        if version:
            orders = carray(argument, (1,))[0]
            fields = carray(data, (_MOST_WORDS,), np.int64)
            memory = _words(orders.memory).copy()
            words = placed(_words(orders.words), _words(orders.relative), address_of(memory))
            whole = carray(pointer(orders.whole + 8 * vehicle), (1,), np.int64)
            whole[0] = _fly(orders, memory, words, _address(model), _address(data), fields, vehicle)

    return fly
