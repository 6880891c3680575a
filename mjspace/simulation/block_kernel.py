"""The compiled function that flies one vehicle through a block of control periods.

It knows no law and no vehicle: its orders say which loops to call on a program's memory, and what
to copy between that memory, MuJoCo and the block's records.
"""

import functools
import hashlib
from pathlib import Path
from typing import Any

import numpy as np
from numba import cfunc, from_dtype, njit, types
from numba.np.numpy_support import carray

from mjspace.compiling import first_use
from mjspace.environment import native_memory
from mjspace.environment.native_memory import pointer
from mjspace.simulation import burning_kernel, mujoco_calls
from mjspace.simulation.burning_kernel import step_burning, table_of, weigh, write
from mjspace.simulation.mujoco_calls import address, of_model_and_data, with_state
from mjspace.tracing import replay
from mjspace.tracing.replay import address_of, copy_bytes, placed, run

_NUMBER, _TABLE = np.int64, (np.int64, (2,))  # a table: its address, its rows
ORDERS = np.dtype([
    # MuJoCo's functions, and the state that mj_getState and mj_setState mean
    ("step", _NUMBER), ("forward", _NUMBER), ("setConst", _NUMBER), ("getState", _NUMBER),
    ("setState", _NUMBER), ("state", _NUMBER),
    # that of them which computes what step effects look at at a control instant, and whether that
    # depends on forces
    ("observe", _NUMBER), ("observes_forces", _NUMBER),
    # numbers of the block's first period and of the flight's last, which is not flown
    ("first", _NUMBER), ("last", _NUMBER),
    # halves to be flown: 2 k is the control instant of the block's period k, 2 k + 1 its steps
    ("begin", _NUMBER), ("end", _NUMBER),
    # where the number of a signal stands, which ends the block
    ("received", _NUMBER),
    # integration steps of a period; 1 where in each of them actuators act, or step effects
    ("steps", _NUMBER), ("driven", _NUMBER), ("prepared", _NUMBER),
    # control period and integration step [s]
    ("control", np.float64), ("physics", np.float64),
    # the program: its memory, its calls' words and which are offsets in the memory, and the calls
    # of each section, with what is copied within the memory after it: (to, from, size)
    ("memory", *_TABLE), ("words", *_TABLE), ("relative", *_TABLE),
    ("weighing", *_TABLE), ("looking", *_TABLE), ("sensing", *_TABLE), ("driving", *_TABLE),
    ("preparing", *_TABLE),
    ("after_looking", *_TABLE), ("after_sensing", *_TABLE), ("after_driving", *_TABLE),
    ("after_preparing", *_TABLE),
    # into the memory at a control instant, and before a period's steps: (to, address, strides of
    # periods and vehicles, size)
    ("inputs", *_TABLE), ("commands", *_TABLE),
    # what a vehicle remembers from block to block: (in the memory, in the vehicle's row, size)
    ("remembered", *_TABLE), ("row", _NUMBER), ("row_stride", _NUMBER),
    # into MuJoCo's arrays, of actuators and of step effects: (word of mjData that points there,
    # offset, from, size), and of mjModel, at a control instant and for a step
    ("applied", *_TABLE), ("written", *_TABLE), ("weighed", *_TABLE), ("masses", *_TABLE),
    # words of mjModel: mass, parent and mass of the subtree of each body, and how many there are;
    # offset in mjData of the most constraints that were in force
    ("body_mass", _NUMBER), ("body_parentid", _NUMBER), ("body_subtreemass", _NUMBER),
    ("bodies", _NUMBER), ("most_constraints", _NUMBER),
    # recorded before and after the first integration step: (in the record, from, size)
    ("before", *_TABLE), ("after", *_TABLE),
    ("record", _NUMBER), ("period_stride", _NUMBER), ("vehicle_stride", _NUMBER),
    # in the memory: the time [s], the state row, the motors that saturate
    ("time", _NUMBER), ("state_row", _NUMBER), ("saturated", *_TABLE),
    ("saturated_record", _NUMBER),
    # MuJoCo's sensors: in the memory, word of mjData, size
    ("sensors", _NUMBER), ("sensors_word", _NUMBER), ("sensors_size", _NUMBER),
    # 1 where step effects look at them at control instants, and in steps; what they report in a
    # section, in the memory; where the period of the first report is noted of each vehicle
    ("looks", _NUMBER), ("looks_in_steps", _NUMBER), ("told_looking", *_TABLE),
    ("told_sensing", *_TABLE), ("told_preparing", *_TABLE), ("stopped", _NUMBER),
])  # fmt: skip
"""What is flown; places in a memory are offsets [bytes], sizes are in bytes."""
_ORDERS = from_dtype(ORDERS)
_FUNCTIONS = 60  # that numba compiles for a block, counted with numba 0.68
_MOST_WORDS = 1 << 20
"""More than mjData has: only words that the tables name are read."""


@njit
def _words(where: Any) -> Any:
    return carray(pointer(where[0]), (where[1],), np.int64)


@njit
def _copy(target: int, source: int, table: Any) -> None:
    """Copy what the rows (to, from, size) of the ``table`` say."""
    for i in range(len(table)):
        copy_bytes(target + table[i, 0], source + table[i, 1], table[i, 2])


@njit
def _copy_inputs(base: int, table: Any, period: int, vehicle: int) -> None:
    """Copy a vehicle's numbers of a period of the block into the memory."""
    for i in range(len(table)):
        source = table[i, 1] + period * table[i, 2] + vehicle * table[i, 3]
        copy_bytes(base + table[i, 0], source, table[i, 4])


@njit
def _told(base: int, where: Any) -> Any:
    """Return whether a step effect has an event to tell."""
    return np.any(carray(pointer(base + where[0]), (where[1],), np.float64) != 0.0)


@njit
def _look(orders: Any, words: Any, base: int, fields: Any) -> Any:
    """Let step effects look at MuJoCo's sensors; return whether they have an event to tell."""
    copy_bytes(base + orders.sensors, fields[orders.sensors_word], orders.sensors_size)
    run(table_of(orders.looking, 5), words)
    if _told(base, orders.told_looking):
        return True
    _copy(base, base, table_of(orders.after_looking, 3))
    return False


@njit
def _begin_period(
    orders: Any,
    base: int,
    words: Any,
    model: int,
    data: int,
    of_model: Any,
    fields: Any,
    record: int,
    k: int,
    derived: Any,
) -> Any:
    """Fly the block's control instant ``k``, whose inputs are in the memory.

    Return whether there is an event. At the first instant Python has looked.
    """
    if k and orders.looks:
        weigh(orders, base, words, model, data, of_model, derived)
        of_model_and_data(orders.observe, model, data)
        if _look(orders, words, base, fields):
            return True
    run(table_of(orders.sensing, 5), words)
    if _told(base, orders.told_sensing):
        return True
    _copy(record, base, table_of(orders.before, 3))
    _copy(base, base, table_of(orders.after_sensing, 3))
    return False


@njit
def _fly_steps(
    orders: Any,
    base: int,
    words: Any,
    model: int,
    data: int,
    of_model: Any,
    fields: Any,
    record: int,
    number: int,
    derived: Any,
) -> Any:
    """Fly the integration steps of that period.

    Return whether it is not to be flown to its end: there is an event in a step, or a signal.
    """
    driving, preparing = table_of(orders.driving, 5), table_of(orders.preparing, 5)
    applied, written = table_of(orders.applied, 4), table_of(orders.written, 4)
    masses, after_driving = table_of(orders.masses, 4), table_of(orders.after_driving, 3)
    after_preparing = table_of(orders.after_preparing, 3)
    time = carray(pointer(base + orders.time), (1,), np.float64)
    motors = orders.saturated[1]
    saturated = carray(pointer(base + orders.saturated[0]), (motors,), np.float64)
    ever = carray(pointer(record + orders.saturated_record), (motors,), np.float64)
    ever[:] = 0.0
    received = carray(pointer(orders.received), (1,), np.int64)
    flown = number < orders.last
    function = orders.step if flown else orders.forward
    for step in range(orders.steps if flown else 1):
        if received[0] != 0:
            return True
        acting = step == 0 or orders.driven != 0
        prepared = step == 0 or orders.prepared != 0
        if step and (acting or prepared):
            time[0] = (number * orders.steps + step) * orders.physics
            with_state(orders.getState, model, data, base + orders.state_row, orders.state)
        if acting:
            run(driving, words)
            write(fields, base, applied)
            for i in range(motors):
                ever[i] = max(ever[i], saturated[i])
        if prepared:
            run(preparing, words)
            if _told(base, orders.told_preparing):
                return True
            write(fields, base, written)
            _copy(base, base, after_preparing)
        if len(masses):
            step_burning(orders, function, model, data, base, of_model, fields, derived)
        else:
            of_model_and_data(function, model, data)
        if step == 0:
            copy_bytes(base + orders.sensors, fields[orders.sensors_word], orders.sensors_size)
            _copy(record, base, table_of(orders.after, 3))
        elif orders.looks_in_steps and _look(orders, words, base, fields):
            return True
        if acting:
            _copy(base, base, after_driving)
    return False


@njit
def _fly(
    orders: Any,
    memory: Any,
    words: Any,
    model: int,
    data: int,
    of_model: Any,
    fields: Any,
    vehicle: int,
) -> None:
    """Fly halves of a block on a ``memory`` and the ``words`` placed there, both kept alive.

    Where a step effect has an event to tell, or a signal is received, the vehicle flies no further.
    """
    base = address_of(memory)
    inputs, commands = table_of(orders.inputs, 5), table_of(orders.commands, 5)
    remembered = table_of(orders.remembered, 3)
    time = carray(pointer(base + orders.time), (1,), np.float64)
    stopped = carray(pointer(orders.stopped + 8 * vehicle), (1,), np.int64)
    row = orders.row + vehicle * orders.row_stride
    derived = np.zeros(3, np.bool_)
    _copy(base, row, remembered)
    for half in range(orders.begin, orders.end):
        k = half // 2
        number = orders.first + k
        record = orders.record + k * orders.period_stride + vehicle * orders.vehicle_stride
        if half % 2 == 0 or half == orders.begin:
            time[0] = number * orders.control
            with_state(orders.getState, model, data, base + orders.state_row, orders.state)
        if half % 2 == 0:
            _copy_inputs(base, inputs, k, vehicle)
            told = _begin_period(
                *(orders, base, words, model, data, of_model, fields, record, k, derived)
            )
        else:
            _copy_inputs(base, commands, k, vehicle)
            told = _fly_steps(
                *(orders, base, words, model, data, of_model, fields, record, number, derived)
            )
        if told:
            stopped[0] = k
            return
    for i in range(len(remembered)):
        copy_bytes(row + remembered[i, 1], base + remembered[i, 0], remembered[i, 2])


@functools.cache
def block_function() -> Any:
    """Return the C function that flies a block: an ``mjfBatchFunc`` whose argument is ``ORDERS``.

    numba's cache of machine code notices changes of this file alone; those of the others that it is
    compiled from make another ``version``, which is part of the cache's key.
    """
    modules = native_memory, replay, mujoco_calls, burning_kernel
    content = b"".join(Path(str(module.__file__)).read_bytes() for module in modules)
    digest = hashlib.sha256(content).digest()
    with first_use(__file__, "the loop of a flight", _FUNCTIONS):
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
            of_model = carray(model, (_MOST_WORDS,), np.int64)
            fields = carray(data, (_MOST_WORDS,), np.int64)
            memory = _words(orders.memory).copy()
            words = placed(_words(orders.words), _words(orders.relative), address_of(memory))
            _fly(orders, memory, words, address(model), address(data), of_model, fields, vehicle)

    return fly
