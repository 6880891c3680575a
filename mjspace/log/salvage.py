"""What is whole in a damaged log: its records, found again after each that is not."""

import io
import mmap
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, Metadata, Schema

from mjspace.errors import InputError
from mjspace.log.content import messages, records, unpacked
from mjspace.log.file import MAGIC
from mjspace.log.index import RECORD, SPAN, ChunkPlace, Exactly, attachment, content
from mjspace.log.limits import MOST

_COMPRESSED = b"\4\0\0\0zstd"  # stands in a chunk's record at byte _MARK
_MARK = RECORD.size + 28
_ATTEMPTS = 8
"""How many times its size a file may make us unpack in vain."""
_OF_FLIGHT = (0, Opcode.CHUNK)
_UNREADABLE = (McapError, ValueError, struct.error)


class Salvage(NamedTuple):
    """The whole records of a log, and what is missing."""

    metadata: dict[str, dict[str, str]]
    attachments: dict[str, tuple[str, bytes]]
    """Media type and content."""
    expected_attachments: set[str]
    """Names in the summary, if there is one."""
    schemas: dict[int, Schema]
    channels: dict[str, Channel]
    chunks: list[ChunkPlace]
    """Whole ones, in the order of the file."""
    lost_bytes: int
    lost_at_end: bool
    """Whether there was more after the last whole chunk than was read."""


class _Search:
    """A walk over a file's records that goes on after damage."""

    def __init__(self, file: BinaryIO, mapped: Any) -> None:
        self.found = Salvage({}, {}, set(), {}, {}, [], 0, lost_at_end=False)
        self._file, self._mapped = file, mapped
        self._in_vain = 0
        self.lost = 0
        self.lost_since_chunk = False

    def run(self) -> None:
        """Walk from the file's beginning to its end."""
        size, position = len(self._mapped), len(MAGIC)
        while position < size and not self._is_end(position):
            taken = self._take(position) if position + RECORD.size <= size else 0
            if not taken:
                following = self._next_chunk(position + 1)
                self.lost += following - position
                # a torn index, or a summary, holds nothing of its own
                self.lost_since_chunk |= self._mapped[position] in _OF_FLIGHT
                position = following
            else:
                position += taken

    def _is_end(self, position: int) -> bool:
        """Tell whether the file ends at ``position``, but for the magic bytes or a part of them."""
        rest = len(self._mapped) - position
        return rest <= len(MAGIC) and bool(self._mapped[position:] == MAGIC[:rest])

    def _take(self, position: int) -> int:
        """Take the record at ``position`` if it is whole; return its size, 0 for damage there."""
        opcode, length = RECORD.unpack(self._mapped[position : position + RECORD.size])
        inner, total = position + RECORD.size, RECORD.size + length
        if not opcode or position + total > len(self._mapped):
            return 0
        try:
            self._add(opcode, inner, length)
        except _UNREADABLE:
            if opcode == Opcode.CHUNK:
                self._in_vain += length + self._claimed(inner)
            if not self._is_record(position + total):
                return 0
            self.lost += total
            self.lost_since_chunk |= opcode == Opcode.CHUNK
        else:
            if opcode == Opcode.CHUNK:
                self.lost_since_chunk = False
        return int(total)

    def _add(self, opcode: int, position: int, length: int) -> None:
        found, file = self.found, self._file
        if opcode == Opcode.CHUNK:
            start, end = SPAN.unpack(self._mapped[position : position + SPAN.size])
            place = ChunkPlace(position, length, start, end, None)
            for kind, data in _definitions(unpacked(file, place)):
                self._declare(kind, data)
            found.chunks.append(place)
        elif opcode == Opcode.ATTACHMENT:
            one = attachment(file, position, length)
            found.attachments.setdefault(one.name, (one.media_type, one.data))
        elif opcode in _SMALL:
            self._declare(opcode, content(file, position, length))
        elif opcode == Opcode.MESSAGE_INDEX:
            if int.from_bytes(self._mapped[position + 2 : position + 6], "little") + 6 != length:
                raise ValueError("its length is not that of its entries")
        elif opcode > Opcode.DATA_END or not self._is_record(position + length):
            raise ValueError("no record of MCAP")

    def _declare(self, opcode: int, data: bytes) -> None:
        stream = Exactly(io.BytesIO(data))
        record = _SMALL[opcode].read(stream)
        if stream.count != len(data):
            raise ValueError("its length is not that of what it holds")
        if opcode == Opcode.SCHEMA:
            self.found.schemas.setdefault(record.id, record)
        elif opcode == Opcode.CHANNEL:
            self.found.channels.setdefault(record.topic, record)
        elif opcode == Opcode.METADATA:
            self.found.metadata.setdefault(record.name, record.metadata)
        else:
            self.found.expected_attachments.add(record.name)

    def _is_record(self, position: int) -> bool:
        """Tell whether a record, or the end, may be at ``position``."""
        size = len(self._mapped)
        if position + RECORD.size > size:
            return self._is_end(position)
        opcode, length = RECORD.unpack(self._mapped[position : position + RECORD.size])
        return bool(0 < opcode <= Opcode.DATA_END and position + RECORD.size + length <= size)

    def _claimed(self, position: int) -> int:
        """Return to how many bytes, of those that are unpacked at all, a chunk claims to unpack."""
        at = position + SPAN.size
        return min(int.from_bytes(self._mapped[at : at + 8], "little"), MOST)

    def _next_chunk(self, position: int) -> int:
        """Return where the next chunk may begin, from ``position`` on; else the file's size."""
        size = len(self._mapped)
        while self._in_vain <= _ATTEMPTS * size + MOST:
            mark = self._mapped.find(_COMPRESSED, position + _MARK)
            if mark < 0:
                break
            start = mark - _MARK
            opcode, length = RECORD.unpack(self._mapped[start : start + RECORD.size])
            if opcode == Opcode.CHUNK and start + RECORD.size + length <= size:
                return int(start)
            position = start + 1
        return size


_SMALL: dict[int, Any] = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.METADATA: Metadata,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex,
}


def salvage(path: Path) -> Salvage:
    """Return what is whole of the log at ``path``.

    Raises:
        OSError: the file cannot be read.
        InputError: it is empty.
    """
    with path.open("rb") as file:
        if not file.seek(0, io.SEEK_END):
            raise InputError(f"{path} is empty")
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as mapped:
            search = _Search(file, mapped)
            search.run()
    found = search.found
    channels = {t: c for t, c in found.channels.items() if c.schema_id in {0, *found.schemas}}
    lost_at_end = search.lost_since_chunk
    return found._replace(channels=channels, lost_bytes=search.lost, lost_at_end=lost_at_end)


def _definitions(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield opcode and content of each schema and channel in a chunk, whose messages are whole."""
    for _ in messages(data):
        pass
    for opcode, at, length in records(data):
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            start = at + RECORD.size
            yield opcode, data[start : start + length]
