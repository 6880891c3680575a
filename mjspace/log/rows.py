"""Rows of periodic topics as the records of a log."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjspace.contract import Array
from mjspace.log.chunk import Nanoseconds, Part, block
from mjspace.log.encoding import Fields, doubles, side_by_side


class TopicGroup:
    """Topics that are logged at the same control periods: their records stand side by side."""

    def __init__(
        self, topics: Mapping[str, Fields], channels: Mapping[str, int], every: int
    ) -> None:
        """``every`` is the number of control periods from one row to the next."""
        self.every = every
        self._topics = topics
        self._channels = {topic: channels[topic] for topic in topics}
        self._layout = side_by_side(
            {topic: doubles(fields).record(channels[topic]) for topic, fields in topics.items()}
        )

    def records(
        self,
        stamps: Nanoseconds,
        sequence: NDArray[np.int_],
        rows: Mapping[str, Mapping[str, Array]],
        chosen: Any,
    ) -> NDArray[np.void]:
        """Return the ``chosen`` ones of n rows as records, whose fields are the topics.

        ``stamps`` and ``sequence`` are (n,), ``rows[topic][field]`` (n, ...).

        Raises:
            ValueError: a wrong shape.
        """
        count = len(stamps)
        records = self._layout.rows(len(stamps[chosen]))
        for topic, fields in self._topics.items():
            stamp(records[topic], stamps[chosen], sequence[chosen])
            columns = records[topic]["message"]
            for field, shape in fields.items():
                values = rows[topic][field]
                if values.shape != (count, *shape):
                    right = (count, *shape)
                    raise ValueError(f"{topic}.{field}: shape {values.shape}, should be {right}")
                columns[field] = values[chosen]
        return records

    def part(self, records: NDArray[np.void]) -> Part:
        """Return records of this group as a part of a chunk."""
        first = next(iter(self._topics))
        return block(records, self._channels, records[first]["header"]["log_time"])


def due(first: int, sequence: NDArray[np.int_], every: int) -> Any:
    """Return the index of what is logged of a flight's control periods, ``sequence`` (n,) of it.

    The flight's first control period, which has the number ``first``, and those whose number
    ``every`` divides.
    """
    if every == 1:
        return slice(None)  # without a copy of the rows
    return np.flatnonzero(((first + sequence) % every == 0) | (sequence == 0))


def stamp(records: NDArray[np.void], stamps: Nanoseconds, sequence: NDArray[np.int_]) -> None:
    """Fill in the headers of one topic's ``records``."""
    header = records["header"]
    header["log_time"] = stamps
    header["publish_time"] = stamps
    header["sequence"] = sequence
