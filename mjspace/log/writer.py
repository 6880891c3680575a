"""Writing a log: blocks of control periods in, one MCAP file out."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from foxglove_schemas_protobuf.Log_pb2 import Log as LogMessage
from numpy.typing import NDArray

from mjspace.contract import Array
from mjspace.log.chunk import Nanoseconds, Part, block, message
from mjspace.log.digest import RECORD, RowDigests
from mjspace.log.encoding import Fields, location, side_by_side, transforms, varint5
from mjspace.log.file import LogFile
from mjspace.log.rows import TopicGroup, due, stamp
from mjspace.log.schema import Scene, channels
from mjspace.units import Unit


class LogWriter:
    """A log that grows by one chunk with each block of control periods.

    A full disk is an ``OSError``; the file then keeps every chunk before that one, as it does when
    the process is killed.
    """

    def __init__(
        self,
        path: Path,
        topics: Mapping[str, Fields],
        metadata: Mapping[str, str],
        attachments: Mapping[str, tuple[str, bytes]],
        scene: Scene,
        units: Mapping[str, Mapping[str, Unit]],
        every: Mapping[str, int] = {},
        first: int = 0,
        located: str = "",
    ) -> None:
        """Create the file.

        ``topics`` gives each periodic topic's fields with their shapes, ``units`` the unit
        of some of them by topic and field; ``attachments`` are (media type, content) by name.
        ``every`` says which control periods of a topic are logged, where not all: those whose
        number it divides, the flight's first, which is number ``first``, and its last.
        ``located`` is the frame whose place on the Earth is logged; "" where that is not known.

        Raises:
            OSError: the file cannot be written.
            ValueError: a topic or a field that the log cannot hold.
        """
        schemas, declared = channels(topics, units, every, located=bool(located))
        self._channels = {channel.topic: channel.id for channel in declared}
        rates = {topic: every.get(topic, 1) for topic in topics}
        self._groups = [
            TopicGroup({t: f for t, f in topics.items() if rates[t] == rate}, self._channels, rate)
            for rate in sorted(set(rates.values()))
        ]
        self._frames = side_by_side({"/tf": transforms(scene.bodies).record(self._channels["/tf"])})
        self._places = (
            side_by_side({"/location": location(located).record(self._channels["/location"])})
            if located
            else None
        )
        self._scene = scene
        self._first = first
        self._count = 0
        self._last = -1
        self._pending: list[Part] = []
        self._last_rows: list[tuple[TopicGroup, NDArray[np.void]]] = []
        self._digests = RowDigests(topics)
        self._file = LogFile(path, schemas, declared, metadata, attachments)

    def write(self, time: Array, rows: Mapping[str, Mapping[str, Array]]) -> None:
        """Log n > 0 control periods at ``time`` [s], shape (n,), as a chunk; arrays are copied.

        ``rows`` holds every field of every topic, shape (n, ...).

        Raises:
            OSError: the chunk cannot be written, or an earlier one could not.
            ValueError: a time not after the one before it, or a wrong shape.
        """
        count = len(time)
        stamps = nanoseconds(time)
        if self._last >= int(stamps[0]) or (stamps[1:] <= stamps[:-1]).any():
            raise ValueError(f"control periods from {time[0]:g} s on: times do not increase")
        if not self._count:
            self._pending = [*self._scene_at(int(stamps[0])), *self._pending]
        sequence = self._count + np.arange(count)
        records = []
        self._last_rows = []
        for group in self._groups:
            chosen = due(self._first, sequence, group.every)
            records.append((group, group.records(stamps, sequence, rows, chosen)))
            if sequence[-1] not in sequence[chosen]:
                last = group.records(stamps, sequence, rows, slice(-1, None))
                self._last_rows.append((group, last))
        self._count += count
        self._last = int(stamps[-1])
        self._add(records)

    def write_transforms(self, time: Array, positions: Array, quaternions: Array) -> None:
        """Log the scene's bodies in ``world`` on /tf, with the next chunk.

        ``time`` [s] of shape (m,), ``positions`` [m] (m, bodies, 3), ``quaternions`` (m, bodies,
        4), scalar first, body to world. A block of few periods may have none.
        """
        if not len(time):
            return
        stamps = nanoseconds(time)
        records = self._frames.rows(len(time))
        stamp(records["/tf"], stamps, np.zeros(len(time), int))
        seconds, rest = (varint5(part) for part in np.divmod(stamps, np.uint64(1_000_000_000)))
        columns = records["/tf"]["message"]
        for i in range(len(self._scene.bodies)):
            columns[f"seconds_{i}"] = seconds
            columns[f"nanoseconds_{i}"] = rest
            columns[f"position_{i}"]["value"] = positions[:, i]
            columns[f"quaternion_{i}"]["value"] = quaternions[:, i, [1, 2, 3, 0]]
        self._pending.append(block(records, {"/tf": self._channels["/tf"]}, stamps))

    def write_locations(self, time: Array, place: Array) -> None:
        """Log where the vehicle is above the Earth on /location, with the next chunk.

        ``time`` [s] of shape (m,); ``place`` (m, 3): latitude [deg], longitude [deg], height [m].
        """
        if self._places is None or not len(time):
            return
        stamps = nanoseconds(time)
        records = self._places.rows(len(time))
        stamp(records["/location"], stamps, np.zeros(len(time), int))
        columns = records["/location"]["message"]
        columns["seconds"], columns["nanoseconds"] = (
            varint5(part) for part in np.divmod(stamps, np.uint64(1_000_000_000))
        )
        columns["place"]["value"] = place
        self._pending.append(block(records, {"/location": self._channels["/location"]}, stamps))

    def event(self, time: float, level: str, text: str) -> None:
        """Log ``text`` on /events with the next chunk; ``level`` is one of ``foxglove.Log``'s."""
        stamp = int(nanoseconds(np.array(time)))
        entry = LogMessage(level=LogMessage.Level.Value(level), message=text)
        entry.timestamp.FromNanoseconds(stamp)
        self._pending.append(message(self._channels["/events"], stamp, entry.SerializeToString()))

    def flush(self) -> None:
        """Write what waits for the next chunk, so that it can be read from the file.

        Raises:
            OSError: something could not be written.
        """
        self._add([])

    def close(self) -> None:
        """Write each topic's last row, what is pending and the summary, and close the file.

        Again it does nothing.

        Raises:
            OSError: something could not be written; the file is closed, and readable up to there.
        """
        try:
            rows, self._last_rows = self._last_rows, []
            self._add(rows)
            self._file.add_metadata(RECORD, self._digests.by_topic())
        finally:
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self.close()
        except OSError:
            if error is None:
                raise

    def _add(self, rows: Sequence[tuple[TopicGroup, NDArray[np.void]]]) -> None:
        """Write ``rows`` and what is pending as a chunk, if there is anything."""
        rows = [(group, records) for group, records in rows if len(records)]
        parts, self._pending = [*(g.part(r) for g, r in rows), *self._pending], []
        if parts:
            self._file.add_chunk(parts)
        for _, records in rows:
            self._digests.add_rows(records)

    def _scene_at(self, stamp: int) -> list[Part]:
        text = self._scene.urdf.encode() + b"\0"
        # CDR, little endian: four bytes that say so, then the string's length with its final zero.
        urdf = b"\0\1\0\0" + len(text).to_bytes(4, "little") + text
        return [
            message(self._channels["/scene"], stamp, self._scene.update),
            message(self._channels["/robot_description"], stamp, urdf),
        ]


def nanoseconds(time: Array) -> Nanoseconds:
    """Return simulation time [s] as the log's integer stamps.

    Raises:
        ValueError: a time before zero, or none.
    """
    if not (time >= 0.0).all():
        raise ValueError(f"times {time}: the log's clock starts at zero")
    return np.rint(time * 1e9).astype(np.uint64)
