"""Laws that remember more than their state: they are called in every period, and not compiled.

A law's ``step`` is a pure function, but one that is being written may count its calls or collect
what it receives. Compiled, it would be called once in a block.
"""

import copy
from collections import deque
from typing import Any

from mjspace.tracing.inner_loops import Untraceable

_PLAIN = (int, float, str, bool, type(None))


def copied(law: Any) -> Any:
    """Return a copy of the ``law`` that shares nothing with it.

    Raises:
        Untraceable: it says ``compiled = False``, or cannot be copied.
    """
    if not getattr(law, "compiled", True):
        raise Untraceable("the law says compiled = False")
    try:
        return copy.deepcopy(law)
    except Exception as error:
        raise Untraceable(f"the law cannot be copied: {type(error).__name__}: {error}") from error


def refuse_hidden_memory(law: Any, before: Any) -> None:
    """Refuse a ``law`` whose attributes have changed since it was a copy of ``before``.

    Raises:
        Untraceable: with the attribute that has.
    """
    earlier = getattr(before, "__dict__", {})
    for name, value in getattr(law, "__dict__", {}).items():
        if name not in earlier:
            continue  # computed at its first use
        was = earlier[name]
        changed = isinstance(value, _PLAIN) and value != was and value == value
        if changed or type(value) is not type(was) or _length(value) != _length(was):
            raise Untraceable(f"the law changes its own {name}")


def _length(value: Any) -> int:
    """Return how many a collection holds; 0 of anything else."""
    return len(value) if isinstance(value, (list, dict, set, tuple, deque)) else 0
