"""Code that would turn a measured value into a constant: it raises, and the program with it."""

import copy
import dataclasses
import math
import pickle
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numba import njit, vectorize
from replaying import assert_replays, replayed, traced, values

from mjspace.tracing.inner_loops import Untraceable
from mjspace.tracing.program import Program


@njit
def _compiled(x: Any) -> Any:
    return x + 1.0


@vectorize(["f8(f8)"])
def _tripled(x: Any) -> Any:
    return 3.0 * x


@dataclasses.dataclass
class _Holder:
    array: Any


def _caught(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return code that goes on with a constant where ``function`` cannot be taken down."""

    def catching(x: Any) -> Any:
        try:
            return x * function(x)
        except Exception:
            return x * 2.0

    return catching


def _filled(x: Any) -> Any:
    array = np.zeros(3)
    array[:] = x[0]
    return array + x[0]


def _filled_one(x: Any) -> Any:
    array = np.zeros(3)
    array[0] = x[0, 0]
    return array + x[0]


def _in_place(x: Any) -> Any:
    array = np.zeros(3)
    array += x[0]
    return array + x[0]


def _out(function: Callable[..., Any]) -> Callable[[Any], Any]:
    def written(x: Any) -> Any:
        array = np.zeros(3)
        function(x, array)
        return array + x[0]

    return written


def _loop(x: Any) -> Any:
    while x[0, 0] < 1.0:
        x = x + 1.0
    return x


BRANCHES: dict[str, Callable[[Any], Any]] = {
    "if": lambda x: x if x[0, 0] > 0.0 else -x,
    "if not": lambda x: x if not x[0, 0] else -x,
    "while": _loop,
    "and": lambda x: (x > 0.0) and (x < 1.0),
    "chain": lambda x: 0.0 < x[0, 0] < 1.0,
    "in": lambda x: x * (1.0 if 0.5 in x[0] else 2.0),
    "in a tuple": lambda x: x * (1.0 if x[0, 0] in (0.5, 1.0) else 2.0),
    "index of": lambda x: x[[0.5].index(x[0, 0])],
    "min": lambda x: min(x[0, 0], x[0, 1]) * x,
    "max of list": lambda x: max(list(x[0])) * x,
    "sorted": lambda x: sorted(x[0])[0] * x,
    "any": lambda x: x * any(x[0] > 0.0),
    "assert": lambda x: x * [1.0][bool(x.any())],
    "compare lists": lambda x: x * (1.0 if [x[0, 0]] == [0.5] else 2.0),
}
NUMBERS: dict[str, Callable[[Any], Any]] = {
    "float": lambda x: float(x[0, 0]) * x,
    "int": lambda x: int(x[0, 0]) * x,
    "complex": lambda x: complex(x[0, 0]) * x,
    "round": lambda x: round(x[0, 0], 2) * x,
    "math": lambda x: math.sin(x[0, 0]) * x,
    "math.floor": lambda x: math.floor(x[0, 0]) * x,
    "math.isclose": lambda x: x * math.isclose(x[0, 0], 1.0),
    "math.fsum": lambda x: math.fsum(x[0]) * x,
    "range": lambda x: x * len(range(x[0, 0])),
    "item": lambda x: x[0, 0].item() * x,
    "tolist": lambda x: x[0].tolist()[0] * x,
    "text": lambda x: float(str(x[0, 0])) * x,
    "format": lambda x: float(f"{x[0, 0]:.3f}") * x,
    "percent": lambda x: float("%.3f" % x[0, 0]) * x,  # noqa: UP031
    "float64": lambda x: np.float64(x[0, 0]) * x,
    "pickle": lambda x: pickle.loads(pickle.dumps(x)) * x,
    "memoryview": lambda x: np.array(memoryview(x)) * x,
    "bytes": lambda x: np.frombuffer(bytes(x[0])) * x,
    "data": lambda x: np.array(x.data) * x,
    "ctypes": lambda x: x * x.ctypes.data,
    "flat": lambda x: x.flat[0] * x,
    "tobytes": lambda x: np.frombuffer(x.tobytes()),
    "view": lambda x: x.view(np.int64),
    "dlpack": lambda x: np.from_dlpack(x) * x,
    "hash": lambda x: x * hash(x),
    "key": lambda x: x * {x[0, 0]: 1.0}.get(x[0, 0]),
}
ARRAYS: dict[str, Callable[[Any], Any]] = {
    "asarray": lambda x: np.asarray(x) * x,
    "ascontiguousarray": lambda x: np.ascontiguousarray(x) * x,
    "array": lambda x: np.array([x[0, 0], x[0, 1], 0.0]) * x[0],
    "array of objects": lambda x: np.array([x[0, 0]], dtype=object) * x,
    "fromiter": lambda x: np.fromiter(x[0], float) * x[0],
    "full": lambda x: np.full(3, x[0, 0]) * x[0],
    "full_like": lambda x: np.full_like(np.zeros(3), x[0, 0]) * x[0],
    "fill": _out(lambda x, array: array.fill(x[0, 0])),
    "put": _out(lambda x, array: array.put([0], x[0, 0])),
    "copyto": _out(lambda x, array: np.copyto(array, x[0])),
    "out": _out(lambda x, array: np.add(x[0], 1.0, out=array)),
    "sum out": _out(lambda x, array: np.sum(x, axis=0, out=array)),
    "take out": _out(lambda x, array: np.take(x[0], [0, 1, 2], out=array)),
    "take out by place": _out(lambda x, array: np.take(x[0], [0, 1, 2], 0, array)),
    "concatenate out": _out(lambda x, array: np.concatenate([x[0, :1], x[0, 1:]], out=array)),
    "concatenate out by place": _out(lambda x, a: np.concatenate([x[0, :1], x[0, 1:]], 0, a)),
    "slice": _filled,
    "element": _filled_one,
    "in place": _in_place,
    "linspace": lambda x: np.linspace(x[0, 0], 1.0, 3) * x[0],
    "arange": lambda x: np.arange(x[0, 0]),
    "interp": lambda x: np.interp(x[0], [0.0, 1.0], [0.0, 2.0]),
    "vectorize": lambda x: np.vectorize(abs)(x),
    "frompyfunc": lambda x: np.frompyfunc(abs, 1, 1)(x) * x,
    "as_strided": lambda x: np.lib.stride_tricks.as_strided(x, (3,), (8,)) * x[0],
    "windows": lambda x: np.lib.stride_tricks.sliding_window_view(x, (1, 1)),
    "shared": lambda x: x * np.may_share_memory(x, x),
    "array_equal": lambda x: x * np.array_equal(x, x),
    "allclose": lambda x: x * np.allclose(x, 0.0),
    "argmax": lambda x: x[:, np.argmax(x)],
    "nonzero": lambda x: x[np.nonzero(x > 0.0)],
    "where alone": lambda x: x[np.where(x > 0.0)],
    "searchsorted": lambda x: np.zeros(3).searchsorted(x[0]) * x,
    "dot": lambda x: np.eye(3).dot(x[0]) * x[0],
    "random": lambda x: np.random.default_rng(0).normal(x[0, 0], 1.0) * x,
    "random shape": lambda x: np.random.default_rng(0).normal(size=x[0, 0]) * x,
    "njit": lambda x: _compiled(x),
    "dtype": lambda x: np.add(x, 1.0, dtype=np.float32),
    "astype": lambda x: x.astype(int) * x,
    "setting the shape": lambda x: setattr(x, "shape", (6,)),
}
INDICES: dict[str, Callable[[Any], Any]] = {
    "mask": lambda x: x[x > 0.0],
    "mask in a list": lambda x: x[[x[0, 0] > 0.0, True]],
    "masked rows": lambda x: x[x[:, 0] > 0.0],
    "slice": lambda x: x[0, x[0, 0] :],
    "of a constant": lambda x: np.zeros(3)[x[0, 0]],
    "mask of a constant": lambda x: np.zeros(3)[x[0] > 0.0].sum() * x,
    "of a list": lambda x: [1.0, 2.0][x[0, 0] > 0.0] * x,
    "assigned": lambda x: x.copy().__setitem__(x > 0.0, 0.0),
    "assigned one by one": lambda x: x.copy().__setitem__([[0, 1], [0, 1]], 0.0),
    "assigned in a list": lambda x: x.copy().__setitem__([x[0, 0] > 0.0, True], 0.0),
    "take": lambda x: np.take([1.0, 2.0], x[0, 0] > 0.0) * x,
    "repeats": lambda x: np.repeat(x, x[0] > 0.0, axis=1),
    "roll": lambda x: np.roll(x, x[0, 0]),
    "roll in a tuple": lambda x: np.roll(x, (x[0, 0],), axis=(0,)),
    "axis": lambda x: np.sum(x, axis=x[0, 0] > 0.0),
    "keepdims": lambda x: np.sum(x, axis=0, keepdims=x[0, 0] > 0.0),
    "initial": lambda x: np.sum(x, initial=x[0, 0]),
    "where": lambda x: np.sum(x, where=x > 0.0),
    "ufunc where": lambda x: np.add(x, 1.0, where=x > 0.0),
    "broadcast": lambda x: np.broadcast_to(1.0, x[0, 0]) * x,
    "choose": lambda x: np.choose(x[0] > 0.0, [x[0], -x[0]]),
    "select": lambda x: np.select([x > 0.0], [x], 0.0),
    "piecewise": lambda x: np.piecewise(x, [x > 0.0], [1.0, 2.0]),
}
KINDS: dict[str, Callable[[Any], Any]] = {
    # Integers: -0 is 0, and -0.0 is not.
    "where": lambda x: np.where(x > 0.0, 1, 0) * -1.0,
    "count": lambda x: -np.sum(x > 0.0) * x,
    "sum": lambda x: (x > 0.0) + 1,
    "stack": lambda x: np.stack([x > 0.0, np.ones((2, 3), int)]),
    "complex": lambda x: x * 1j,
    "where complex": lambda x: np.where(x > 0.0, 1j, x),
    "assigned complex": lambda x: x.copy().__setitem__(0, 1j),
    "None": lambda x: x == None,  # noqa: E711
    "float32": lambda x: np.concatenate([x, x], dtype=np.float32),
    "objects": lambda x: x * np.array([1, 2, 3], dtype=object),
    "long": lambda x: x * np.ones(3, np.longdouble),
    "power": lambda x: x[0, 0] ** np.int64(3),  # of NumPy's own loop, other than Python's
    "power of": lambda x: np.float64(3.0) ** x[0, 0],
    "accumulate": lambda x: np.add.accumulate(x),
    "outer": lambda x: np.add.outer(x, x),
    "at": lambda x: np.add.at(x.copy(), [0], 1.0),
    "cumsum": lambda x: x.cumsum(),
}
LISTS: dict[str, Callable[[Any], Any]] = {
    "operand": lambda x: x[0] + [x[0, 0], x[0, 1], 1.0],
    "ufunc": lambda x: np.add(x[0], (x[0, 0], x[0, 1], 1.0)),
    "where": lambda x: np.where(x[0] > 0.0, [x[0, 0], x[0, 1], 1.0], x[0]),
    "condition": lambda x: np.where([x[0, 0] > 0.0, True, False], x[0], 0.0),
    "clip": lambda x: np.clip(x[0], [x[0, 0], 0.0, 0.0], 1.0),
    "cross": lambda x: np.cross([x[0, 0], 1.0, 2.0], x[1]),
    "assigned": lambda x: x.copy().__setitem__(0, [x[0, 0], x[0, 1], 1.0]),
    "concatenate": lambda x: np.concatenate([[x[0, 0], x[0, 1]], x[0]]),
    "stack": lambda x: np.stack([x[0], [x[0, 0], x[0, 1], 1.0]]),
    "full_like": lambda x: np.full_like(x, [x[0, 0], x[0, 1], 1.0]),
    "norm": lambda x: np.linalg.norm([x[0, 0], x[0, 1]]) * x,
    "sum": lambda x: np.sum([x[0, 0], x[0, 1]]) * x,
}
FREEZING = {
    f"{group} {name}": function
    for group, functions in {
        "branch:": BRANCHES,
        "number:": NUMBERS,
        "array:": ARRAYS,
        "index:": INDICES,
        "kind:": KINDS,
        "list:": LISTS,
    }.items()
    for name, function in functions.items()
}
X = np.array([[0.5, -2.0, 0.25], [1.5, 3.0, -0.75]])


@pytest.mark.parametrize("name", FREEZING)
def test_what_would_freeze_a_value_raises(name: str) -> None:
    program = Program()
    held = program.copied(X)
    kinds = (Untraceable, TypeError, ValueError, AttributeError, BufferError)
    warnings.simplefilter("ignore")  # of what NumPy deprecates; pytest restores it
    with pytest.raises(kinds), program.section(), np.errstate(all="ignore"):
        FREEZING[name](traced(program, held))


REFUSED = {**BRANCHES, **LISTS}


@pytest.mark.parametrize("name", REFUSED)
def test_a_caught_error_ends_the_program_all_the_same(name: str) -> None:
    with pytest.raises(Untraceable):
        replayed(_caught(REFUSED[name]), [X], [X])


@pytest.mark.parametrize(
    "function",
    [
        copy.copy,
        copy.deepcopy,
        lambda x: copy.deepcopy({"kept": [x]})["kept"][0],
        lambda x: dataclasses.replace(_Holder(x)).array,
        lambda x: dataclasses.asdict(_Holder(x))["array"],
        lambda x: x if isinstance(x, np.ndarray) else x * np.nan,
        lambda x: x if isinstance(x[0, 0], float) else x * np.nan,
        lambda x: x if np.isscalar(x[0, 0]) and not np.isscalar(x) else x * np.nan,
        lambda x: x * (2.0 if isinstance(x, (list, tuple)) else 1.0),
        lambda x: x * (2.0 if x is None else 1.0),
        lambda x: x * (2.0 if hasattr(x, "imaginary") else 1.0),
        lambda x: _tripled(x),
        lambda x: [1.0, 2.0, 3.0] * x,
        lambda x: np.float64(2.0) * x,
    ],
)
def test_what_looks_like_freezing_and_is_not(function: Any) -> None:
    def written(x: Any) -> Any:
        result = function(x) + 0.0
        result += 1.0
        return result, x * 1.0

    assert_replays(written, [X], [values(3, 2, 3)])


def test_a_copy_can_be_written_to_alone() -> None:
    def written(x: Any) -> Any:
        first = x * 1.0
        second, third = copy.copy(first), copy.deepcopy(first)
        second += 1.0
        third *= 2.0
        return first, second, third

    assert_replays(written, [X], [values(3, 2, 3)])


def test_an_array_kept_from_an_earlier_program_raises() -> None:
    kept: list[Any] = []

    def keeping(x: Any) -> Any:
        kept.append(x)
        return x * kept[0]

    replayed(keeping, [X], [X])
    for function in (
        lambda x: x * kept[0],
        lambda x: np.stack([x, kept[0]]),
        lambda x: x + kept[0][0],
    ):
        with pytest.raises(Untraceable, match="kept from an earlier call"):
            replayed(function, [X], [X])
    with pytest.raises(Untraceable, match="kept from an earlier call"):
        np.add(kept[0], 1.0)


def test_a_reason_says_what_would_be_right() -> None:
    for function, reason in [
        (BRANCHES["if"], "a branch on a measured value"),
        (NUMBERS["float"], "a Python number"),
        (ARRAYS["array"], "np.stack"),
        (ARRAYS["in place"], "measured values are written to"),
        (INDICES["mask"], "an index that is measured"),
        (ARRAYS["interp"], "np.interp"),
        (INDICES["initial"], "np.sum with a measured option"),
        (lambda x: np.sum(x, initial=1.0), "np.sum: .*initial"),
        (KINDS["where"], "np.where of int64"),
        (KINDS["cumsum"], "an array's cumsum"),
    ]:
        with pytest.raises(Untraceable, match=reason):
            replayed(function, [X], [X])


def test_more_memory_than_there_is_raises() -> None:
    with pytest.raises(Untraceable, match="bytes of arrays"):
        replayed(lambda x: np.broadcast_to(x[0, 0], (400, 400)) + 1.0, [X], [X])
