"""The inner loops of NumPy's ufuncs: C functions that compiled code may call by address.

A ufunc holds a table of functions ``loop(args, dimensions, steps, data)``, one for each combination
of types. The table's place in ``PyUFuncObject`` is part of NumPy's public C interface
(``numpy/ufuncobject.h``); it is checked against what Python knows of each ufunc.
"""

import ctypes
from typing import Any, NamedTuple

import numpy as np


class Untraceable(Exception):  # noqa: N818 - says what the code is
    """Array code that cannot be taken down as calls of inner loops, with the reason."""


class InnerLoop(NamedTuple):
    """A C function, and the pointer that it wants to be called with."""

    address: int
    data: int


class _UFuncHead(ctypes.Structure):
    """The beginning of ``PyUFuncObject``."""

    _fields_ = (
        ("reference_count", ctypes.c_ssize_t),
        ("type", ctypes.c_void_p),
        ("nin", ctypes.c_int),
        ("nout", ctypes.c_int),
        ("nargs", ctypes.c_int),
        ("identity", ctypes.c_int),
        ("functions", ctypes.POINTER(ctypes.c_void_p)),
        ("data", ctypes.POINTER(ctypes.c_void_p)),
        ("ntypes", ctypes.c_int),
        ("reserved", ctypes.c_int),
        ("name", ctypes.c_char_p),
        ("types", ctypes.POINTER(ctypes.c_char)),
    )


def inner_loop(ufunc: np.ufunc, types: tuple[np.dtype[Any], ...]) -> InnerLoop:
    """Return the loop of ``ufunc`` over operands of exactly these ``types``, outputs last.

    Raises:
        Untraceable: it has none, or its table is not where NumPy's C interface says.
    """
    head = _UFuncHead.from_address(id(ufunc))
    described = (ufunc.nin, ufunc.nout, ufunc.nargs, ufunc.ntypes)
    if (head.nin, head.nout, head.nargs, head.ntypes) != described:
        raise Untraceable(f"NumPy {np.__version__} has no table of loops in its ufuncs")
    numbers = [kind.num for kind in types]
    for index in range(ufunc.ntypes):
        first = index * ufunc.nargs
        if [head.types[first + k][0] for k in range(ufunc.nargs)] == numbers:
            data = head.data[index] if head.data else None
            if head.functions[index]:
                return InnerLoop(head.functions[index], data or 0)
    raise Untraceable(f"np.{ufunc.__name__} has no loop over {', '.join(map(str, types))}")
