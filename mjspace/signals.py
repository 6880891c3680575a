"""Logged signals by name: ``truth.rate[0]`` is a topic, its field and some of its components."""

import re
from collections.abc import Iterable, Mapping

import numpy as np

from mjspace.contract import Array
from mjspace.errors import nearest

Topics = Mapping[str, Mapping[str, tuple[int, ...]]]
"""The shape of each field of each topic."""


def find_signal(topics: Topics, signal: str) -> tuple[str, str, slice]:
    """Return the topic, field and components that ``signal`` names.

    ``truth.rate`` is all of it, ``truth.rate[0]`` one component, ``truth.rate[0:2]`` the first two.

    Raises:
        ValueError: there is none, with the near names.
    """
    match = re.fullmatch(r"/?(\w+)\.(\w+)(?:\[(\d+)(?::(\d+))?\])?", signal)
    if match is None:
        raise ValueError(
            f"signal {signal!r}: write topic.field, topic.field[i] or topic.field[i:j]"
        )
    topic, field = "/" + match[1], match[2]
    names = [f"{name[1:]}.{f}" for name, fields in topics.items() for f in fields]
    if field not in topics.get(topic, {}):
        raise ValueError(f"no signal {signal!r} in the log{nearest(f'{match[1]}.{field}', names)}")
    size = int(np.prod(topics[topic][field]))
    start = int(match[3] or 0)
    end = int(match[4]) if match[4] else start + 1 if match[3] else size
    if not start < end <= size:
        raise ValueError(f"signal {signal!r}: {topic[1:]}.{field} has {size} components")
    return topic, field, slice(start, end)


def by_topic(fields: Iterable[tuple[str, str]]) -> dict[str, list[str]]:
    """Return ``fields``, each with its topic before it, as the fields of each topic, each once."""
    found: dict[str, list[str]] = {}
    for topic, field in dict.fromkeys(fields):
        found.setdefault(topic, []).append(field)
    return found


def magnitude(rows: Array) -> Array:
    """Return a signal's values (...) from its ``rows`` (..., k): of a vector its norm."""
    values: Array = rows[..., 0] if rows.shape[-1] == 1 else np.linalg.norm(rows, axis=-1)
    return values
