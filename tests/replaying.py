"""Array code taken down on some inputs and run again on others, for tests."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mjspace.tracing.program import Program
from mjspace.tracing.replay import placed, prove, run
from mjspace.tracing.traced_array import TracedArray

_SPECIAL = np.array([0.0, -0.0, np.nan, np.inf, -np.inf, 5e-324, -1e-310, 1.0, -1.0, 1e308])


def values(seed: int, *shape: int, special: float = 0.2) -> np.ndarray:
    """Return random numbers of many sizes, a share of them ``special``: infinities and the like."""
    rng = np.random.default_rng(seed)
    ordinary = rng.normal(size=shape) * 10.0 ** rng.integers(-3, 3, shape)
    return np.where(rng.random(shape) < special, rng.choice(_SPECIAL, shape), ordinary)


def traced(program: Program, held: np.ndarray) -> Any:
    """Return an array of the memory as code receives it: it cannot be written to."""
    view = held.view()
    view.setflags(write=False)
    return TracedArray(view, program)


def replayed(function: Callable[..., Any], first: Sequence[Any], then: Sequence[Any]) -> list[Any]:
    """Return the results on ``then`` of the program that ``function`` made on ``first``.

    Inputs are arrays or numbers; results are one array, or a tuple of several.
    """
    program = Program()
    inputs = [program.copied(each) for each in first]
    with np.errstate(all="ignore"):
        with program.section() as section:
            results = function(*(traced(program, each) for each in inputs))
        prove(section[0], program.memory)
        memory = program.memory.copy()
        for held, new in zip(inputs, then, strict=True):
            new = np.asarray(new, held.dtype)
            assert new.shape == held.shape
            array = np.ndarray(held.shape, held.dtype, memory, program.offset(held))
            array[...] = new
        calls = section[0]
        run(calls.table, placed(calls.words, calls.relative, memory.ctypes.data))
    return [
        np.ndarray(a.shape, a.dtype, memory, program.offset(a), a.strides).copy()
        for a in (each.array for each in _several(results))
    ]


def assert_replays(function: Callable[..., Any], first: Sequence[Any], then: Sequence[Any]) -> None:
    """Compare the program's results on ``then`` with NumPy's, bit by bit but for a NaN's sign.

    That sign is an accident of how many elements a loop takes at once.
    """
    with np.errstate(all="ignore"):
        expected = _several(function(*then))
    found = replayed(function, first, then)
    assert len(found) == len(expected)
    for one, other in zip(found, map(np.asarray, expected), strict=True):
        assert (one.shape, one.dtype) == (other.shape, other.dtype)
        assert _bits(one) == _bits(other), (one, other)


def _several(results: Any) -> tuple[Any, ...]:
    return results if type(results) is tuple else (results,)


def _bits(array: np.ndarray) -> bytes:
    return np.where(array != array, np.nan, array).tobytes()
