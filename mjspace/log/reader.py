"""Reading a log: NumPy arrays by topic and field, one chunk in memory at a time."""

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjspace.contract import Array, Event
from mjspace.errors import InputError
from mjspace.log import checked, digest
from mjspace.log.content import Content, read_content
from mjspace.log.encoding import doubles
from mjspace.log.index import ChunkPlace, inventory, read_attachment
from mjspace.log.schema import PERIODIC, declared


class Log:
    """A flight's log, whole or cut short: every chunk that was written completely is there.

    Nothing stays open between calls. Read at once are ``metadata``, ``complete`` (not cut short),
    ``topics`` (shapes by periodic topic and field), ``units`` (by topic and field, where one is
    declared) and ``every`` (the number of control periods from one row of a topic to the next);
    everything else is read when it is used.
    """

    def __init__(self, path: Path | str) -> None:
        """Open a log.

        Raises:
            OSError: the file cannot be read.
            InputError: it is not an MCAP file, not a log of mjspace, or damaged.
        """
        self.path = Path(path)
        self._found = found = inventory(self.path)
        self.metadata = found.metadata
        self.complete = found.complete
        self.topics: dict[str, dict[str, tuple[int, ...]]] = {}
        self.units: dict[str, dict[str, str]] = {}
        self.every: dict[str, int] = {}
        self._dtypes: dict[str, np.dtype[np.void]] = {}
        for topic in PERIODIC:
            if topic in found.channels:
                channel = found.channels[topic]
                try:
                    shapes, units, every = declared(channel, found.schemas.get(channel.schema_id))
                    self._dtypes[topic] = doubles(shapes).record(0).dtype
                except ValueError as error:
                    message = f"{path}: {topic} is not as mjspace logs it: {error}"
                    raise InputError(message) from error
                self.topics[topic], self.units[topic], self.every[topic] = shapes, units, every

    @classmethod
    def of(cls, log: "Log | Path | str") -> "Log":
        """Return ``log`` itself, or the log at that path.

        Raises:
            OSError: the file cannot be read.
            InputError: it is not an MCAP file, not a log of mjspace, or damaged.
        """
        return log if isinstance(log, Log) else cls(log)

    @property
    def attachments(self) -> tuple[str, ...]:
        """Names of the attachments."""
        return tuple(self._found.attachments)

    def attachment(self, name: str) -> bytes:
        """Return an attachment's content.

        Raises:
            InputError: there is none of that name.
        """
        if name not in self._found.attachments:
            have = ", ".join(self.attachments) or "none"
            raise InputError(f"no attachment {name!r} in {self.path}: have {have}")
        return read_attachment(self.path, name, *self._found.attachments[name])

    def shape(self, topic: str, field: str) -> tuple[int, ...]:
        """Return a field's shape; InputError where the log lacks it."""
        self._fields(topic, [field])
        return self.topics[topic][field]

    @property
    def control_period(self) -> float:
        """The control period of the flight [s]; InputError where the metadata lack it."""
        return checked.number(self.path, self.metadata, checked.CONTROL_PERIOD, above=0.0)

    @property
    def member(self) -> int:
        """The number of the vehicle in its campaign; InputError where the metadata lack it."""
        return int(checked.number(self.path, self.metadata, "member", above=-1.0))

    def __len__(self) -> int:
        """Return the number of control periods."""
        return int(self._ends[1]["sequence"]) + 1 if self._ends else 0

    @property
    def start(self) -> float:
        """Time of the first control period [s]; ValueError when there is none."""
        return float(self._some_ends[0]["log_time"]) / 1e9

    @property
    def end(self) -> float:
        """Time of the last control period [s]; ValueError when there is none."""
        return float(self._some_ends[1]["log_time"]) / 1e9

    def blocks(
        self,
        topic: str,
        fields: Sequence[str] | None = None,
        start: float | None = None,
        end: float | None = None,
        every: int = 1,
    ) -> Iterator[dict[str, Array]]:
        """Yield a periodic topic by chunks: ``time`` [s], shape (n,), and each field, (n, ...).

        From ``start`` to ``end`` [s], both included, and of those rows the first and every
        ``every``-th after it.

        Raises:
            InputError: the log has no such topic or field, or a chunk is damaged.
        """
        for found in self.blocks_of_topics({topic: fields}, start, end, every):
            yield found[topic]

    def blocks_of_topics(
        self,
        fields: Mapping[str, Sequence[str] | None],
        start: float | None = None,
        end: float | None = None,
        every: int = 1,
    ) -> Iterator[dict[str, dict[str, Array]]]:
        """Yield the ``blocks`` of several periodic topics side by side: each chunk is read once.

        ``fields`` are by topic, None for all of it. A chunk without rows of a topic lacks it.

        Raises:
            InputError: the log has no such topic or field, or a chunk is damaged.
        """
        names = {topic: self._fields(topic, chosen) for topic, chosen in fields.items()}
        first = 0 if start is None else max(round(start * 1e9), 0)
        stop = 2**63 if end is None else max(round(end * 1e9) + 1, 0)
        places = [c for c in self._found.chunks if c.end >= first and c.start < stop]
        skip, last = dict.fromkeys(names, 0), dict.fromkeys(names, -1)
        for content in self._rows(names, places):
            found = {}
            for topic, rows in content.items():
                stamps = rows["header"]["log_time"]
                if int(stamps[0]) <= last[topic]:
                    at = f"after t = {last[topic] / 1e9:g} s"
                    raise InputError(f"{self.path}: {topic} is damaged {at}: time does not go on")
                last[topic] = int(stamps[-1])
                low, high = np.searchsorted(stamps, np.array([first, stop], np.uint64))
                if low + skip[topic] < high:
                    chosen = rows[low + skip[topic] : high : every]
                    found[topic] = _columns(chosen, names[topic])
                skip[topic] = (skip[topic] - (high - low)) % every
            if found:
                yield found

    def read(
        self,
        topic: str,
        fields: Sequence[str] | None = None,
        start: float | None = None,
        end: float | None = None,
        every: int = 1,
    ) -> dict[str, Array]:
        """Return the ``blocks`` of a topic as one: see there."""
        return self.read_topics({topic: fields}, start, end, every)[topic]

    def read_topics(
        self,
        fields: Mapping[str, Sequence[str] | None],
        start: float | None = None,
        end: float | None = None,
        every: int = 1,
    ) -> dict[str, dict[str, Array]]:
        """Return the ``blocks_of_topics`` as one: see there."""
        blocks = list(self.blocks_of_topics(fields, start, end, every))
        return {
            topic: self._joined(topic, chosen, [block[topic] for block in blocks if topic in block])
            for topic, chosen in fields.items()
        }

    def nearest(self, topic: str, time: float) -> dict[str, Array]:
        """Return the row of a topic nearest to ``time`` [s]: ``time``, shape (), and every field.

        Raises:
            InputError: the log has no such topic, no row, or a damaged chunk.
        """
        names = self._fields(topic, None)
        channel, stamp = self._found.channels[topic].id, round(time * 1e9)
        places = [p for p in self._found.chunks if p.indexes is None or channel in p.indexes]
        # The rows on either side are in the last chunk that starts before ``time``, the one before
        # it (an /events or /tf stamp may be all that starts it so early) or the one after it.
        after = bisect_right(places, stamp, key=lambda place: place.start)
        found = [rows[topic] for rows in self._rows([topic], places[max(after - 2, 0) : after + 1])]
        if not found:
            raise InputError(f"{self.path} holds nothing on {topic} near {time:g} s")
        rows = np.concatenate(found)
        best = np.abs(rows["header"]["log_time"].astype(np.int64) - stamp).argmin()
        return _columns(rows[best], names)

    def altered(self) -> list[str] | None:
        """Return the topics whose rows are not those that were written, by the log's digests.

        None: not known, as of a log that was cut short.

        Raises:
            InputError: a chunk is damaged.
        """
        if not (self.complete and self._found.digests):
            return None
        found = digest.RowDigests(self.topics)
        topics = self._topics_of(self.topics)
        for content in self._contents(topics, self._found.chunks):
            for channel in content.channels:
                with self._damage_of(topics[channel]):
                    tails = content.tails(channel, digest.FROM)
                found.add_messages(topics[channel], tails)
        now, written = found.by_topic(), self._found.digests
        return [topic for topic in written | now if now.get(topic) != written.get(topic)]

    def events(self) -> list[Event]:
        """Return the entries of /events, in the order in which they were logged.

        Raises:
            InputError: a chunk or an entry is damaged.
        """
        found = list(self.records("/events"))
        with self._damage_of("/events"):
            return [checked.event(record) for record in found]

    def records(self, topic: str) -> Iterator[bytes]:
        """Yield the Message records of any topic, each whole; InputError: a chunk is damaged."""
        for content in self._contents(self._topics_of([topic]), self._found.chunks):
            for channel in content.channels:
                with self._damage_of(topic):
                    yield from content.records(channel)

    @cached_property
    def _ends(self) -> tuple[np.void, np.void] | None:
        """Headers of the first and the last control period."""
        # Of the topic that is logged most often: a log that was cut short ends with a row of that.
        topic = min(self.every, key=self.every.__getitem__, default="/state")
        for rows in self._rows([topic], self._found.chunks):
            first = rows[topic]["header"][0]
            last = next(self._rows([topic], reversed(self._found.chunks)))[topic]["header"][-1]
            if checked.CONTROL_PERIOD in self.metadata:
                checked.span(self.path, topic, first, last, self.control_period)
            return first, last
        return None

    def require_periods(self) -> None:
        """Make sure that the log holds something of a flight.

        Raises:
            InputError: it was cut short before its first chunk, or has no control period at all.
        """
        if self._ends is None:
            cut = "" if self.complete else " was cut short before its first chunk: it"
            raise InputError(f"{self.path}{cut} holds no control period")

    @property
    def _some_ends(self) -> tuple[np.void, np.void]:
        self.require_periods()
        assert self._ends is not None
        return self._ends

    def _fields(self, topic: str, fields: Sequence[str] | None) -> Sequence[str]:
        if topic not in self.topics:
            raise InputError(f"no topic {topic!r} in {self.path}: have {', '.join(self.topics)}")
        known = self.topics[topic]
        for name in fields or ():
            if name not in known:
                raise InputError(
                    f"no field {name!r} on {topic} in {self.path}: have {', '.join(known)}"
                )
        return list(known) if fields is None else fields

    def _joined(
        self, topic: str, fields: Sequence[str] | None, blocks: Sequence[Mapping[str, Array]]
    ) -> dict[str, Array]:
        shapes = {"time": ()} | self.topics[topic]
        return {
            name: np.concatenate([np.empty((0, *shapes[name])), *(block[name] for block in blocks)])
            for name in ("time", *self._fields(topic, fields))
        }

    def _rows(
        self, topics: Iterable[str], places: Iterable[ChunkPlace]
    ) -> Iterator[dict[str, NDArray[np.void]]]:
        """Yield the rows that each of ``places`` has on periodic topics, where it has any."""
        channels, places = self._topics_of(topics), list(places)
        for place, content in zip(places, self._contents(channels, places), strict=True):
            found = {}
            for channel in content.channels:
                topic = channels[channel]
                with self._damage_of(topic):
                    found[topic] = content.rows(channel, self._dtypes[topic])
                    checked.stamps(found[topic]["header"]["log_time"], place)
            if found:
                yield found

    def _contents(
        self, channels: Mapping[int, str], places: Iterable[ChunkPlace]
    ) -> Iterator[Content]:
        """Yield the content of each of ``places`` on the channels."""
        with self.path.open("rb") as file:
            for place in places:
                try:
                    content = read_content(file, place, channels)
                except ValueError as error:
                    raise InputError(self._damaged(place, error)) from error
                yield content

    def _damaged(self, place: ChunkPlace, error: Exception) -> str:
        count, before = len(self._found.chunks), self._found.chunks.index(place)
        return (
            f"{self.path}: the chunk at byte {place.position} cannot be read: {error}; it is "
            f"number {before + 1} of {count}, from t = {place.start / 1e9:g} s: 'mjspace recover' "
            "writes what can be saved"
        )

    @contextmanager
    def _damage_of(self, topic: str) -> Iterator[None]:
        """Turn a ValueError of reading ``topic`` into an InputError that names it."""
        try:
            yield
        except ValueError as error:
            raise InputError(
                f"{self.path}: {topic} is not laid out as mjspace writes it: {error}"
            ) from error

    def _topics_of(self, topics: Iterable[str]) -> dict[int, str]:
        """Return those of ``topics`` that the log has, by their channels."""
        found = self._found.channels
        return {found[topic].id: topic for topic in topics if topic in found}


def _columns(rows: Any, names: Sequence[str]) -> dict[str, Array]:
    # Copied, aligned and contiguous: a view would keep the whole chunk in memory.
    columns = {name: np.array(rows["message"][name], float) for name in names}
    return {"time": np.asarray(rows["header"]["log_time"] / 1e9)} | columns
