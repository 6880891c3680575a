"""A log as columns of numbers: which signals, and which of their rows."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from mjspace.contract import Array
from mjspace.log.reader import Log
from mjspace.signals import by_topic, find_signal

NOT_FOR_PEOPLE = "/state"
"""The topic that is left out unless it is chosen: what a replay begins from, bit for bit."""
_WHOLE = 1e-6


class Signal(NamedTuple):
    """A field of a topic, or some of its components."""

    topic: str
    field: str
    part: slice
    size: int
    """Of the field: how many numbers it has."""

    @property
    def name(self) -> str:
        """As ``truth.rate``."""
        return f"{self.topic.removeprefix('/')}.{self.field}"

    def of(self, rows: Array) -> Array:
        """Return the signal's numbers, (n, k), of the field's ``rows`` (n, ...)."""
        return rows.reshape(len(rows), -1)[:, self.part]

    @property
    def columns(self) -> list[str]:
        """A name for each number: ``truth.rate[0]``; without an index where there is one alone."""
        indices = range(self.part.start, self.part.stop)
        return [self.name if self.size == 1 else f"{self.name}[{i}]" for i in indices]


def select(log: Log, signals: Sequence[str] = (), topics: Sequence[str] = ()) -> list[Signal]:
    """Return the ``signals``, named as in a check, and all of the ``topics``; all where none is.

    Raises:
        ValueError: the log has no such signal or topic, with the near names.
    """
    found = []
    for signal in signals:
        topic, field, part = find_signal(log.topics, signal)
        found.append(Signal(topic, field, part, int(np.prod(log.topics[topic][field]))))
    chosen = [topic if topic.startswith("/") else f"/{topic}" for topic in topics]
    if not (signals or topics):
        chosen = [topic for topic in log.topics if topic != NOT_FOR_PEOPLE]
    for topic in chosen:
        if topic not in log.topics:
            raise ValueError(f"no topic {topic!r} in the log: have {', '.join(log.topics)}")
        for field, shape in log.topics[topic].items():
            size = int(np.prod(shape))
            if size:
                found.append(Signal(topic, field, slice(0, size), size))
    return found


def stride(log: Log, rate: float | None) -> int:
    """Return how many control periods are from one row to the next at a ``rate`` [Hz].

    Raises:
        ValueError: the rate is above the log's, or no whole number of control periods fits.
    """
    if rate is None:
        return 1
    periods = 1.0 / (rate * log.control_period) if rate > 0.0 else 0.0
    if periods < 1.0 - _WHOLE or abs(periods - round(periods)) > _WHOLE * periods:
        most = 1.0 / log.control_period
        raise ValueError(
            f"rate: {rate:g} Hz, should be the log's {most:g} Hz over a whole number: as "
            f"{most / max(round(periods), 1):g} Hz"
        )
    return round(periods)


def blocks(
    log: Log, signals: Sequence[Signal], every: int, start: float | None = None
) -> Iterator[dict[str, dict[str, Array]]]:
    """Yield the rows of the signals' fields by topic, chunk by chunk, every so many periods.

    Each topic has ``time`` [s], (n,), and the fields, (n, ...): what falls on a period whose number
    is a multiple of ``every``.
    """
    fields = by_topic((signal.topic, signal.field) for signal in signals)
    for found in log.blocks_of_topics(fields, start):
        kept = {}
        for topic, rows in found.items():
            number = np.rint(rows["time"] / log.control_period)
            chosen = number % every == 0
            if chosen.any():
                kept[topic] = {name: values[chosen] for name, values in rows.items()}
        if kept:
            yield kept


def table(log: Log, signals: Sequence[Signal], every: int) -> Iterator[Array]:
    """Yield rows (n, 1 + columns): the time [s] and every signal's numbers, chunk by chunk.

    Not a number where a topic that is logged less often has no row.
    """
    width = 1 + sum(len(signal.columns) for signal in signals)
    for found in blocks(log, signals, every):
        times = np.unique(np.concatenate([rows["time"] for rows in found.values()]))
        rows = np.full((len(times), width), np.nan)
        rows[:, 0] = times
        first = 1
        for signal in signals:
            count = len(signal.columns)
            if signal.topic in found:
                of_topic = found[signal.topic]
                at = np.searchsorted(times, of_topic["time"])
                rows[at, first : first + count] = signal.of(of_topic[signal.field])
            first += count
        yield rows
