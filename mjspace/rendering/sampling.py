"""Rows of a log nearest to given times."""

from collections.abc import Iterator

import numpy as np

from mjspace.contract import Array
from mjspace.log.reader import Log


def nearest_rows(log: Log, topic: str, field: str, times: Array) -> Iterator[Array]:
    """Yield the field's value logged nearest to each of the ascending ``times`` (n,) [s].

    The log is read once, with one block of it in memory.

    Raises:
        ValueError: the log does not have the topic or field, or no row near the times.
    """
    margin = log.control_period * log.every[topic]
    stamps, rows, done = np.empty(0), np.empty((0, *log.shape(topic, field))), 0
    start, end = max(times[0] - margin, 0.0), times[-1] + margin
    for block in log.blocks(topic, [field], start=start, end=end):
        # The last row so far may be nearer to a time than the first one of this block.
        stamps = np.concatenate([stamps[-1:], block["time"]])
        rows = np.concatenate([rows[-1:], block[field]])
        due = int(np.searchsorted(times, stamps[-1], side="right"))
        for time in times[done:due]:
            yield rows[np.abs(stamps - time).argmin()]
        done = due
    if not len(stamps):
        raise ValueError(f"{log.path} has no {topic} near {times[0]:g} s")
    for _ in times[done:]:
        yield rows[-1]
