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

from mjspace.environment import native_memory
from mjspace.environment.native_memory import pointer
from mjspace.simulation import mujoco_calls
from mjspace.simulation.mujoco_calls import address, of_model_and_data, with_state
from mjspace.tracing import replay
from mjspace.tracing.replay import address_of, copy_bytes, placed, run

_NUMBER, _TABLE = np.int64, (np.int64, (2,))  # a table: its address, its rows
ORDERS = np.dtype([
    # MuJoCo's functions, and the state that mj_getState and mj_setState mean
    ("step", _NUMBER), ("forward", _NUMBER), ("setConst", _NUMBER), ("getState", _NUMBER),
    ("setState", _NUMBER), ("state", _NUMBER),
    # that of them which computes what step effects look at at a control instant
    ("observe", _NUMBER),
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
    ("looking", *_TABLE), ("sensing", *_TABLE), ("driving", *_TABLE), ("preparing", *_TABLE),
    ("after_looking", *_TABLE), ("after_sensing", *_TABLE), ("after_driving", *_TABLE),
    # into the memory at a control instant, and before a period's steps: (to, address, strides of
    # periods and vehicles, size)
    ("inputs", *_TABLE), ("commands", *_TABLE),
    # what a vehicle remembers from block to block: (in the memory, in the vehicle's row, size)
    ("remembered", *_TABLE), ("row", _NUMBER), ("row_stride", _NUMBER),
    # into MuJoCo's arrays, of actuators and of step effects: (word of mjData that points there,
    # offset, from, size), and of mjModel
    ("applied", *_TABLE), ("written", *_TABLE), ("masses", *_TABLE),
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
_MOST_WORDS = 1 << 20
"""More than mjData has: only words that the tables name are read."""


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
def _copy_inputs(base: int, table: Any, period: int, vehicle: int) -> None:
    """Copy a vehicle's numbers of a period of the block into the memory."""
    for i in range(len(table)):
        source = table[i, 1] + period * table[i, 2] + vehicle * table[i, 3]
        copy_bytes(base + table[i, 0], source, table[i, 4])


@njit
def _write(fields: Any, base: int, table: Any) -> None:
    """Write what the rows (word, offset, from, size) of the ``table`` say into MuJoCo's arrays."""
    for i in range(len(table)):
        copy_bytes(fields[table[i, 0]] + table[i, 1], base + table[i, 2], table[i, 3])


@njit
def _differs(fields: Any, base: int, table: Any) -> bool:
    """Return whether writing would change any of MuJoCo's numbers."""
    for i in range(len(table)):
        count = table[i, 3] // 8
        present = carray(pointer(fields[table[i, 0]] + table[i, 1]), (count,), np.float64)
        if np.any(present != carray(pointer(base + table[i, 2]), (count,), np.float64)):
            return True
    return False


@njit
def _write_masses(orders: Any, fields: Any, base: int) -> None:
    """Write masses and inertias, and sum up each body's subtree as ``mj_setConst`` does."""
    _write(fields, base, _table(orders.masses, 4))
    bodies = orders.bodies
    mass = carray(pointer(fields[orders.body_mass]), (bodies,), np.float64)
    parent = carray(pointer(fields[orders.body_parentid]), (bodies,), np.int32)
    subtree = carray(pointer(fields[orders.body_subtreemass]), (bodies,), np.float64)
    subtree[:] = mass
    for body in range(bodies - 1, 0, -1):
        subtree[parent[body]] += subtree[body]


@njit
def _derive(orders: Any, model: int, data: int, base: int, fields: Any) -> None:
    """Derive the model's constants, and return to the step that begins."""
    of_model_and_data(orders.setConst, model, data)
    with_state(orders.setState, model, data, base + orders.state_row, orders.state)
    _write(fields, base, _table(orders.applied, 4))
    _write(fields, base, _table(orders.written, 4))


@njit
def _step_burning(
    orders: Any,
    function: int,
    model: int,
    data: int,
    base: int,
    of_model: Any,
    fields: Any,
    derived: Any,
) -> None:
    """Make a step with the masses of the moment.

    Of what ``mj_setConst`` derives from masses, a step reads the subtrees' masses, and where a
    constraint is in force the rest as well: as it takes 0.6 of a step's time, that is derived for
    such steps alone. ``derived`` is whether the masses have been written in this call, whether all
    is derived from them, and whether the last step needed it.
    """
    if not derived[0] or _differs(of_model, base, _table(orders.masses, 4)):
        _write_masses(orders, of_model, base)
        derived[0], derived[1] = True, False
    most = carray(pointer(data + orders.most_constraints), (1,), np.int32)
    if derived[2] and not derived[1]:
        _derive(orders, model, data, base, fields)
        derived[1] = True
    most[0] = 0
    of_model_and_data(function, model, data)
    derived[2] = most[0] > 0
    if derived[2] and not derived[1]:
        _derive(orders, model, data, base, fields)
        derived[1] = True
        of_model_and_data(function, model, data)


@njit
def _told(base: int, where: Any) -> Any:
    """Return whether a step effect has an event to tell."""
    return np.any(carray(pointer(base + where[0]), (where[1],), np.float64) != 0.0)


@njit
def _look(orders: Any, words: Any, base: int, fields: Any) -> Any:
    """Let step effects look at MuJoCo's sensors; return whether they have an event to tell."""
    copy_bytes(base + orders.sensors, fields[orders.sensors_word], orders.sensors_size)
    run(_table(orders.looking, 5), words)
    if _told(base, orders.told_looking):
        return True
    _copy(base, base, _table(orders.after_looking, 3))
    return False


@njit
def _begin_period(
    orders: Any, base: int, words: Any, model: int, data: int, fields: Any, record: int, k: int
) -> Any:
    """Fly the block's control instant ``k``, whose inputs are in the memory.

    Return whether there is an event. At the first instant Python has looked.
    """
    if k and orders.looks:
        of_model_and_data(orders.observe, model, data)
        if _look(orders, words, base, fields):
            return True
    run(_table(orders.sensing, 5), words)
    if _told(base, orders.told_sensing):
        return True
    _copy(record, base, _table(orders.before, 3))
    _copy(base, base, _table(orders.after_sensing, 3))
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
    driving, preparing = _table(orders.driving, 5), _table(orders.preparing, 5)
    applied, written = _table(orders.applied, 4), _table(orders.written, 4)
    masses, after_driving = _table(orders.masses, 4), _table(orders.after_driving, 3)
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
            _write(fields, base, applied)
            for i in range(motors):
                ever[i] = max(ever[i], saturated[i])
        if prepared:
            run(preparing, words)
            if _told(base, orders.told_preparing):
                return True
            _write(fields, base, written)
        if len(masses):
            _step_burning(orders, function, model, data, base, of_model, fields, derived)
        else:
            of_model_and_data(function, model, data)
        if step == 0:
            copy_bytes(base + orders.sensors, fields[orders.sensors_word], orders.sensors_size)
            _copy(record, base, _table(orders.after, 3))
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
    inputs, commands = _table(orders.inputs, 5), _table(orders.commands, 5)
    remembered = _table(orders.remembered, 3)
    time = carray(pointer(base + orders.time), (1,), np.float64)
    stopped = carray(pointer(orders.stopped + 8 * vehicle), (1,), np.int64)
    row = orders.row + vehicle * orders.row_stride
    derived = np.zeros(3, np.bool_)
    _copy(base, row, remembered)
    if orders.begin and orders.masses[1]:  # what is seen depends on them, in the last digits
        _write_masses(orders, of_model, base)
        derived[0] = True
    for half in range(orders.begin, orders.end):
        k = half // 2
        number = orders.first + k
        record = orders.record + k * orders.period_stride + vehicle * orders.vehicle_stride
        if half % 2 == 0 or half == orders.begin:
            time[0] = number * orders.control
            with_state(orders.getState, model, data, base + orders.state_row, orders.state)
        if half % 2 == 0:
            _copy_inputs(base, inputs, k, vehicle)
            told = _begin_period(orders, base, words, model, data, fields, record, k)
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
    files = (native_memory.__file__, replay.__file__, mujoco_calls.__file__)
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
            of_model = carray(model, (_MOST_WORDS,), np.int64)
            fields = carray(data, (_MOST_WORDS,), np.int64)
            memory = _words(orders.memory).copy()
            words = placed(_words(orders.words), _words(orders.relative), address_of(memory))
            _fly(orders, memory, words, address(model), address(data), of_model, fields, vehicle)

    return fly
