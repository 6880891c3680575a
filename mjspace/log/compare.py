"""Two logs side by side: how much each signal differs, and from when on."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mjspace.contract import TICK, Array
from mjspace.log.columns import Signal, select
from mjspace.log.reader import Log
from mjspace.signals import by_topic

_Rows = dict[str, dict[str, Array]]  # by topic and field
_PERIODS = 20_000
"""Control periods of both logs in memory at a time."""


@dataclass
class SignalDifference:
    """By how much a signal differs between two logs, at the instants that both have."""

    name: str
    unit: str
    largest: float = 0.0
    """Largest difference of a component; not a number where only one of the two is one."""
    at: float = 0.0
    """When [s]."""
    rms: float = 0.0
    """Root of the mean square over instants and components."""
    scale: float = 0.0
    """Largest magnitude in the first log."""
    beyond: float | None = None
    """First instant at which it is larger than the tolerance [s]; None: never."""
    rows: int = 0
    squares: float = field(default=0.0, repr=False)
    """Sum of the squares of all differences."""

    @property
    def share(self) -> float:
        """The largest difference over the largest magnitude in the first log."""
        return self.largest / self.scale if self.scale else (math.inf if self.largest else 0.0)

    def add(self, time: Array, first: Array, second: Array, tolerance: float) -> None:
        """Take in rows (n, k) of both at each ``time`` (n,) [s]."""
        both = np.isnan(first) & np.isnan(second) | (first == second)  # infinities too
        with np.errstate(invalid="ignore"):
            off = np.where(both, 0.0, np.abs(first - second))
        worst = np.where(np.isnan(off), np.inf, off).max(axis=1)
        k = int(np.argmax(worst))
        if worst[k] > self.largest:
            self.largest, self.at = float(worst[k]), float(time[k])
        over = np.flatnonzero(worst > tolerance)
        if len(over) and self.beyond is None:
            self.beyond = float(time[over[0]])
        finite = np.abs(first[np.isfinite(first)])
        self.scale = max(self.scale, float(finite.max(initial=0.0)))
        self.squares += float(np.sum(np.where(np.isnan(off), np.inf, off) ** 2))
        self.rows += len(time)
        self.rms = math.sqrt(self.squares / (self.rows * first.shape[1]))


@dataclass(frozen=True)
class Comparison:
    """Of two logs."""

    signals: list[SignalDifference]
    """In the order of the log; those that both have in the same shape."""
    only_first: list[str]
    only_second: list[str]
    start: float
    """First common instant [s]."""
    end: float
    """Last common instant [s]."""

    @property
    def beyond(self) -> list[SignalDifference]:
        """The signals that differ by more than the tolerance at some instant."""
        return [signal for signal in self.signals if signal.beyond is not None]


def compare(
    first: Log | Path | str,
    second: Log | Path | str,
    *,
    signals: Sequence[str] = (),
    topics: Sequence[str] = (),
    tolerance: float = 0.0,
    progress: Callable[[float], None] = lambda time: None,
) -> Comparison:
    """Compare two logs, signal by signal, at the instants that both have logged.

    ``signals`` are named as in a check, ``topics`` as in the log; all but /state where neither is
    given. ``tolerance`` is in each signal's SI unit. A part of both logs is in memory at a time.

    Raises:
        ValueError: no such signal or topic in the first log, or no common instant.
        InputError: a log is damaged.
        OSError: a log cannot be read.
    """
    one, two = Log.of(first), Log.of(second)
    chosen = select(one, signals, topics)
    of_topics = {each.topic for each in chosen}
    others = [] if signals else [s for s in select(two) if not topics or s.topic in of_topics]
    common = [each for each in chosen if _shape(two, each) == _shape(one, each)]
    found = [SignalDifference(each.name, _unit(one, each)) for each in common]
    fields = by_topic((each.topic, each.field) for each in common)
    start, end = max(one.start, two.start), min(one.end, two.end)
    for rows, other_rows in _together(one, two, fields, start, end):
        for signal, difference in zip(common, found, strict=True):
            a, b = rows[signal.topic], other_rows[signal.topic]
            stamps = np.rint(1e9 * a["time"]), np.rint(1e9 * b["time"])
            time: Array = np.intersect1d(*stamps, assume_unique=True)
            if len(time):
                i, j = (np.searchsorted(each, time) for each in stamps)
                first_rows, second_rows = a[signal.field][i], b[signal.field][j]
                difference.add(
                    1e-9 * time, signal.of(first_rows), signal.of(second_rows), tolerance
                )
                progress(1e-9 * float(time[-1]))
    if not any(difference.rows for difference in found):
        raise ValueError(f"{one.path} and {two.path} have no instant of a signal in common")
    named = {each.name for each in common}
    return Comparison(
        signals=[difference for difference in found if difference.rows],
        only_first=[each.name for each in chosen if each.name not in named],
        only_second=[each.name for each in others if each.name not in named],
        start=start,
        end=end,
    )


def _together(
    one: Log, two: Log, fields: dict[str, list[str]], start: float, end: float
) -> Iterator[tuple[_Rows, _Rows]]:
    """Yield the rows of both logs from ``start`` to ``end`` [s], some periods at a time."""
    span = _PERIODS * max(one.control_period, two.control_period)
    count = math.floor((end - start) / span) + 1 if fields and end >= start else 0
    for number in range(count):
        begin = start + number * span
        until = min(begin + span, end)
        a, b = (log.read_topics(fields, begin, until) for log in (one, two))
        if number < count - 1:
            a, b = _before(a, until), _before(b, until)
        yield a, b


def _before(topics: _Rows, until: float) -> _Rows:
    """Return the rows before ``until`` [s]."""
    return {
        topic: {name: values[rows["time"] < until - TICK] for name, values in rows.items()}
        for topic, rows in topics.items()
    }


def _shape(log: Log, signal: Signal) -> tuple[int, ...] | None:
    return log.topics.get(signal.topic, {}).get(signal.field)


def _unit(log: Log, signal: Signal) -> str:
    return log.units[signal.topic].get(signal.field, "")
