"""Writing a log: blocks of control periods in, one MCAP file out."""

from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from foxglove_schemas_protobuf.Log_pb2 import Log as LogMessage
from numpy.typing import NDArray

from mjspace.contract import Array
from mjspace.log.chunk import Nanoseconds, Part, block, message
from mjspace.log.digest import RECORD, RowDigests
from mjspace.log.encoding import Fields, doubles, side_by_side, transforms, varint5
from mjspace.log.file import LogFile
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
    ) -> None:
        """Create the file.

        ``topics`` gives each periodic topic's fields with their shapes, ``units`` the unit
        of some of them by topic and field; ``attachments`` are (media type, content) by name.

        Raises:
            OSError: the file cannot be written.
            ValueError: a topic or a field that the log cannot hold.
        """
        schemas, declared = channels(topics, units)
        self._topics = {topic: dict(fields) for topic, fields in topics.items()}
        self._channels = {channel.topic: channel.id for channel in declared}
        records = {t: doubles(fields).record(self._channels[t]) for t, fields in topics.items()}
        self._periods = side_by_side(records)
        self._frames = side_by_side({"/tf": transforms(scene.bodies).record(self._channels["/tf"])})
        self._scene = scene
        self._count = 0
        self._last = -1
        self._pending: list[Part] = []
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
        sequence = np.arange(self._count, self._count + count)
        records = self._periods.rows(count)
        for topic, fields in self._topics.items():
            _stamp(records[topic], stamps, sequence)
            columns = records[topic]["message"]
            for field, shape in fields.items():
                values = rows[topic][field]
                if values.shape != (count, *shape):
                    right = (count, *shape)
                    raise ValueError(f"{topic}.{field}: shape {values.shape}, should be {right}")
                columns[field] = values
        if not self._count:
            self._pending = [*self._scene_at(int(stamps[0])), *self._pending]
        self._count += count
        self._last = int(stamps[-1])
        periodic = {topic: self._channels[topic] for topic in self._topics}
        parts, self._pending = [block(records, periodic, stamps), *self._pending], []
        self._file.add_chunk(parts)
        self._digests.add_rows(records)

    def write_transforms(self, time: Array, positions: Array, quaternions: Array) -> None:
        """Log the scene's bodies in ``world`` on /tf, with the next chunk.

        ``time`` [s] of shape (m,), ``positions`` [m] (m, bodies, 3), ``quaternions`` (m, bodies,
        4), scalar first, body to world. A block of few periods may have none.
        """
        if not len(time):
            return
        stamps = nanoseconds(time)
        records = self._frames.rows(len(time))
        _stamp(records["/tf"], stamps, np.zeros(len(time), int))
        seconds, rest = (varint5(part) for part in np.divmod(stamps, np.uint64(1_000_000_000)))
        columns = records["/tf"]["message"]
        for i in range(len(self._scene.bodies)):
            columns[f"seconds_{i}"] = seconds
            columns[f"nanoseconds_{i}"] = rest
            columns[f"position_{i}"]["value"] = positions[:, i]
            columns[f"quaternion_{i}"]["value"] = quaternions[:, i, [1, 2, 3, 0]]
        self._pending.append(block(records, {"/tf": self._channels["/tf"]}, stamps))

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
        parts, self._pending = self._pending, []
        if parts:
            self._file.add_chunk(parts)

    def close(self) -> None:
        """Write what is pending and the summary, and close the file; again does nothing.

        Raises:
            OSError: something could not be written; the file is closed, and readable up to there.
        """
        try:
            self.flush()
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


def _stamp(records: NDArray[np.void], stamps: Nanoseconds, sequence: NDArray[np.int_]) -> None:
    header = records["header"]
    header["log_time"] = stamps
    header["publish_time"] = stamps
    header["sequence"] = sequence
