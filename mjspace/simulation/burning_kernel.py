"""The masses of bodies that burn, in the compiled function that flies a block of periods.

Its orders are those of ``block_kernel``.
"""

from typing import Any

import numpy as np
from numba import njit
from numba.np.numpy_support import carray

from mjspace.environment.native_memory import pointer
from mjspace.simulation.mujoco_calls import of_model_and_data, with_state
from mjspace.tracing.replay import copy_bytes, run


@njit
def table_of(where: Any, columns: int) -> Any:
    """Return a table of the orders, (rows, columns), from its address and its rows."""
    return carray(pointer(where[0]), (where[1], columns), np.int64)


@njit
def write(fields: Any, base: int, table: Any) -> None:
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
def _set_masses(orders: Any, fields: Any, base: int, table: Any, derived: Any) -> None:
    """Write masses and inertias, and sum up each body's subtree as ``mj_setConst`` does.

    Not where that would change nothing. ``derived`` is whether they have been written in this call
    of the compiled function, whether all is derived from them, and whether the last step needed it.
    """
    if derived[0] and not _differs(fields, base, table):
        return
    derived[0], derived[1] = True, False
    write(fields, base, table)
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
    write(fields, base, table_of(orders.applied, 4))
    write(fields, base, table_of(orders.written, 4))


@njit
def step_burning(
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
    such steps alone.
    """
    _set_masses(orders, of_model, base, table_of(orders.masses, 4), derived)
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
def weigh(
    orders: Any, base: int, words: Any, model: int, data: int, of_model: Any, derived: Any
) -> None:
    """Set the masses of a control instant, and derive the model's constants where they are felt."""
    weighed = table_of(orders.weighed, 4)
    if not len(weighed):
        return
    run(table_of(orders.weighing, 5), words)
    _set_masses(orders, of_model, base, weighed, derived)
    if orders.observes_forces and not derived[1]:
        of_model_and_data(orders.setConst, model, data)
        with_state(orders.setState, model, data, base + orders.state_row, orders.state)
        derived[1] = True
