"""Long signals in few points: the least and the greatest value of each stretch of a log."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from mjspace.contract import Array
from mjspace.log.reader import Log
from mjspace.signals import by_topic

POINTS = 4000  # more than a page has pixels across
_TOGETHER = 10_000  # rows of which the extremes are found at once: a chunk's are too few


class Line(NamedTuple):
    """What is drawn of a log: a field of one of its topics."""

    topic: str
    field: str
    change: Callable[[Array], Array] = lambda rows: rows
    """Applied first, to rows (n, c) in the log's order."""


def outlines(log: Log, lines: Sequence[Line], points: int = POINTS) -> list[tuple[Array, Array]]:
    """Return (time [s], value) of each line's c components, each (m, c), with m <= ``points`` + 2.

    Each component has its own times: those of its extremes. Where the log has no more rows than
    ``points``, all are there. The log is read once, with one chunk of it in memory.

    Raises:
        ValueError: the log has no such topic or field, or no row of it.
    """
    periods = round((log.end - log.start) / log.control_period) + 1
    # Two points for each stretch, in their order: a stretch of two rows is those two.
    drawn = [
        _Outline(line, max(2, math.ceil(2 * periods / (points * log.every[line.topic]))))
        for line in lines
    ]
    for blocks in log.blocks_of_topics(by_topic((line.topic, line.field) for line in lines)):
        for outline in drawn:
            if outline.line.topic in blocks:
                outline.add(blocks[outline.line.topic])
    for outline in drawn:
        if not outline.begun:
            raise ValueError(f"{log.path} holds nothing on {outline.line.topic}")
    return [outline.points() for outline in drawn]


class _Outline:
    """The extremes of a line so far, and the rows that are not in a stretch yet."""

    def __init__(self, line: Line, width: int) -> None:
        self.line = line
        self._width = width
        self._stamps: list[Array] = []
        self._rows: list[Array] = []
        self._done: list[tuple[Array, Array]] = []

    @property
    def begun(self) -> bool:
        """Whether there is any row."""
        return bool(self._stamps)

    def add(self, block: Mapping[str, Array]) -> None:
        """Add the rows of a chunk."""
        time = block["time"]
        self._stamps.append(time)
        self._rows.append(self.line.change(block[self.line.field].reshape(len(time), -1)))
        if sum(map(len, self._stamps)) >= _TOGETHER:
            stamps, rows = np.concatenate(self._stamps), np.concatenate(self._rows)
            whole = len(stamps) // self._width * self._width
            self._done.append(_extremes(stamps[:whole], rows[:whole], self._width))
            self._stamps, self._rows = [stamps[whole:]], [rows[whole:]]

    def points(self) -> tuple[Array, Array]:
        """Return times and values, each (m, c), with those of the last stretch."""
        stamps, rows = np.concatenate(self._stamps), np.concatenate(self._rows)
        if missing := -len(stamps) % self._width:
            stamps = np.pad(stamps, (0, missing), mode="edge")
            rows = np.pad(rows, ((0, missing), (0, 0)), mode="edge")
        times, values = zip(*self._done, _extremes(stamps, rows, self._width), strict=True)
        return np.concatenate(times), np.concatenate(values)


def _extremes(stamps: Array, rows: Array, width: int) -> tuple[Array, Array]:
    """Return times and values of two rows for each ``width`` of them, shapes (m, c)."""
    components = rows.shape[1]
    stretches = rows.reshape(-1, width, components)
    first_last = np.sort([stretches.argmin(axis=1), stretches.argmax(axis=1)], axis=0)
    chosen = np.moveaxis(first_last, 0, 1)
    times = np.broadcast_to(stamps.reshape(-1, width, 1), stretches.shape)
    return (
        np.take_along_axis(times, chosen, axis=1).reshape(-1, components),
        np.take_along_axis(stretches, chosen, axis=1).reshape(-1, components),
    )
