"""Laws that remember more than their state: they are called in every period, and not compiled.

A law's ``step`` is a pure function, but one that is being written may count its calls or collect
what it receives. Compiled, it would be called once in a block.
"""

import copy
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from mjspace.tracing.inner_loops import Untraceable

_VALUES = (bool, int, float, complex, str, bytes, type(None))
_COLLECTIONS = (list, tuple, set, deque)
_DEPTH = 6  # of attributes within attributes


@contextmanager
def refusing_hidden_memory(law: Any) -> Iterator[Any]:
    """Give a copy of the ``law`` to be called, and leave the law and its module as they were.

    Raises:
        Untraceable: it says ``compiled = False``; cannot be copied; or has changed itself, or a
            variable of its module, when the context ends.
    """
    if not getattr(law, "compiled", True):
        raise Untraceable("the law says compiled = False")
    modules = list(_modules_of(law))
    kept = (*_VALUES, *_COLLECTIONS, dict, np.ndarray)
    try:
        called = copy.deepcopy(law)
        before = [
            {
                name: copy.deepcopy(value)
                for name, value in variables.items()
                if isinstance(value, kept) and name != "__builtins__"  # Python's, not the law's
            }
            for variables in modules
        ]
    except Exception as error:
        raise Untraceable(f"the law cannot be copied: {type(error).__name__}: {error}") from error
    try:
        yield called
    finally:
        changed: list[str] = []
        for variables, values in zip(modules, before, strict=True):
            own = {n: v for n, v in values.items() if not _same(variables.get(n), v)}
            variables.update(own)
            changed += own
    if changed:
        raise Untraceable(f"the law changes {changed[0]} of its module")
    mine, its = (getattr(each, "__dict__", {}) for each in (law, called))
    for name in mine.keys() & its.keys():  # others are computed at their first use
        if not _same(its[name], mine[name]):
            raise Untraceable(f"the law changes its own {name}")


def _modules_of(law: Any) -> Iterator[dict[str, Any]]:
    """Yield the variables of the law's module, and of those of the laws and estimators in it."""
    seen: list[dict[str, Any]] = []
    for each in (law, *getattr(law, "__dict__", {}).values()):
        variables = getattr(getattr(type(each), "step", None), "__globals__", None)
        if variables is not None and not any(variables is other for other in seen):
            seen.append(variables)
            yield variables


def _same(one: Any, other: Any, depth: int = _DEPTH) -> bool:
    """Return whether the two, one of which was a copy of the other, are still alike."""
    if one is other or depth == 0:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return bool(one.shape == other.shape and one.tobytes() == other.tobytes())
    if isinstance(one, _VALUES):
        return bool(one == other) or one != one
    if isinstance(one, set):
        return bool(one == other)
    if isinstance(one, _COLLECTIONS):
        pairs = zip(one, other, strict=False)
        return len(one) == len(other) and all(_same(a, b, depth - 1) for a, b in pairs)
    if not isinstance(one, dict):
        one, other = getattr(one, "__dict__", {}), getattr(other, "__dict__", {})
        return all(_same(one[name], other[name], depth - 1) for name in one.keys() & other.keys())
    return one.keys() == other.keys() and all(_same(v, other[k], depth - 1) for k, v in one.items())
