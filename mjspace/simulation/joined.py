"""The named tuples of an estimator and of a law joined into one, and separated again.

An estimator and a law fly as one law, whose state and signals are joined tuples: a field of each
begins with its owner, ``estimator_covariance`` or ``law_integral``. What a law that flies alone
returns is joined to nothing: all of it is the law's.
"""

import functools
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

from mjspace.contract import Array

ESTIMATOR, LAW = "estimator", "law"
_PART_OF_ESTIMATOR = {"signals": "estimate"}


class Joined:
    """Base of joined named tuples."""

    owned: ClassVar[Mapping[str, type]]
    """The named tuple, or the empty one, of estimator and law."""


def join(estimator: Any, law: Any) -> Any:
    """Return the named tuples, either of which may be empty or None, as one."""
    estimator, law = estimator or (), law or ()
    kinds: Any = type(estimator), type(law)
    return _kind(*kinds)(*estimator, *law)


@functools.cache
def _kind(estimator: type, law: type) -> Any:
    """Return the class of what is joined: one and the same in each period."""
    owned = {ESTIMATOR: estimator, LAW: law}
    names = [f"{owner}_{name}" for owner, kind in owned.items() for name in _fields(kind)]
    base: Any = NamedTuple("Joined", [(name, Array) for name in names])  # type: ignore[misc]
    return type("Joined", (Joined, base), {"__slots__": (), "owned": owned})


def separate(arrays: Any) -> dict[str, Any]:
    """Return the named tuples of estimator and law, by owner, of what may be joined."""
    kind = type(arrays)
    if not issubclass(kind, Joined):
        return {LAW: arrays}
    count = len(_fields(kind.owned[ESTIMATOR]))
    own = {ESTIMATOR: arrays[:count], LAW: arrays[count:]}
    return {owner: part(*own[owner]) if _fields(part) else () for owner, part in kind.owned.items()}


def kinds(kind: type) -> Mapping[str, type]:
    """Return the class of named tuple of each owner."""
    return kind.owned if issubclass(kind, Joined) else {LAW: kind}


def columns(kind: type, arrays: Mapping[str, Array]) -> dict[str, dict[str, Array]]:
    """Return arrays by the field's name of such a named tuple, by owner and field."""
    if not issubclass(kind, Joined):
        return {LAW: dict(arrays)}
    found: dict[str, dict[str, Array]] = {ESTIMATOR: {}, LAW: {}}
    for name, array in arrays.items():
        owner, _, field = name.partition("_")
        found[owner][field] = array
    return found


def topics_of(signals: Any) -> dict[str, Any]:
    """Return the named tuples of what a law, or estimator and law, signal, by topic."""
    own = separate(signals)
    estimate = {_PART_OF_ESTIMATOR["signals"]: own[ESTIMATOR]} if ESTIMATOR in own else {}
    return estimate | {LAW: own[LAW]}


def names_in_state(kind: type) -> list[str]:
    """Return the name that each field of a state has in the log's /state."""
    return [f"{owner}_{name}" for owner, part in kinds(kind).items() for name in _fields(part)]


def of_whom(part: str, arrays: Any) -> dict[str, dict[str, Array]]:
    """Return arrays by field under the words that say what they are: ``the law's signals``.

    ``part`` is "state", "command" or "signals"; ``arrays`` a named tuple, an empty one or None.
    """
    return {
        f"the estimator's {_PART_OF_ESTIMATOR.get(part, part)}"
        if owner == ESTIMATOR
        else f"the law's {part}": dict(zip(_fields(type(own)), own or (), strict=True))
        for owner, own in separate(arrays).items()
    }


def _fields(kind: type) -> tuple[str, ...]:
    return getattr(kind, "_fields", ())
