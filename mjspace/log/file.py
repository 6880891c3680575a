"""An MCAP file that grows by compressed chunks."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from mjspace.log.chunk import Part, encode, record_bytes, sealed
from mjspace.log.lock import create

MAGIC = b"\x89MCAP0\r\n"
"""What an MCAP file begins and ends with."""
NAME = "mjspace"
"""Of the metadata record that every log of mjspace has."""


class LogFile:
    """An MCAP file open for writing.

    After a write that failed every other one fails with the same error.
    """

    def __init__(
        self,
        path: Path,
        schemas: Sequence[Schema],
        channels: Sequence[Channel],
        metadata: Mapping[str, str],
        attachments: Mapping[str, tuple[str, bytes]],
    ) -> None:
        """Create ``path`` with everything that a reader needs before the first chunk.

        Raises:
            FileExistsError: there is something already.
            OSError: it cannot be written.
        """
        self._registry = {
            Opcode.SCHEMA: record_bytes(*schemas),
            Opcode.CHANNEL: record_bytes(*channels),
        }
        note = record_bytes(Metadata(NAME, dict(metadata)))
        head = MAGIC + record_bytes(Header("", NAME))
        self._metadata_indexes = [MetadataIndex(len(head), len(note), NAME)]
        head += note + b"".join(self._registry.values())
        indexes = []
        for name, (media_type, data) in attachments.items():
            record = record_bytes(Attachment(0, 0, name, media_type, data))
            indexes.append(
                AttachmentIndex(len(head), len(record), 0, 0, len(data), name, media_type)
            )
            head += record
        self._attachment_indexes = indexes
        self._statistics = Statistics(
            attachment_count=len(attachments),
            channel_count=len(channels),
            channel_message_counts=Counter(),
            chunk_count=0,
            message_count=0,
            message_end_time=0,
            message_start_time=0,
            metadata_count=1,
            schema_count=len(schemas),
        )
        self._chunk_indexes = bytearray()
        self._error: OSError | None = None
        self._position = 0
        self._file = create(path)
        try:
            self._put(head)
        except OSError:
            self._file.close()
            path.unlink(missing_ok=True)  # without its head it is nothing
            raise

    def add_chunk(self, parts: Sequence[Part]) -> None:
        """Compress ``parts`` and write them as one chunk."""
        data, index, counts = encode(parts, self._position)
        self._put(data)
        self._chunk_indexes += record_bytes(index)
        self._count(index, counts)

    def add_metadata(self, name: str, metadata: Mapping[str, str]) -> None:
        """Write a metadata record after every chunk so far, unless the file is closed."""
        if self._file.closed:
            return
        record = record_bytes(Metadata(name, dict(metadata)))
        self._metadata_indexes.append(MetadataIndex(self._position, len(record), name))
        self._statistics.metadata_count += 1
        self._put(record)

    def close(self) -> None:
        """Write the summary and close the file; again does nothing."""
        if self._file.closed:
            return
        try:
            self._put(self._ending())
        finally:
            self._file.close()

    def _count(self, index: ChunkIndex, counts: Mapping[int, int]) -> None:
        total = self._statistics
        earlier = total.message_start_time if total.chunk_count else index.message_start_time
        total.message_start_time = min(earlier, index.message_start_time)
        total.chunk_count += 1
        total.message_count += sum(counts.values())
        total.message_end_time = max(total.message_end_time, index.message_end_time)
        for channel, count in counts.items():
            total.channel_message_counts[channel] += count

    def _put(self, data: bytes) -> None:
        """Hand ``data`` to the operating system, all of it."""
        if self._error:
            raise self._error  # what follows a torn record could never be found
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            error.filename = self._file.name
            self._error = error
            raise
        self._position += len(data)

    def _ending(self) -> bytes:
        groups = {
            **self._registry,
            Opcode.STATISTICS: record_bytes(self._statistics),
            Opcode.CHUNK_INDEX: bytes(self._chunk_indexes),
            Opcode.METADATA_INDEX: record_bytes(*self._metadata_indexes),
            Opcode.ATTACHMENT_INDEX: record_bytes(*self._attachment_indexes),
        }
        data_end = record_bytes(DataEnd(0))
        start = self._position + len(data_end)
        summary, offsets = b"", []
        for opcode, group in groups.items():
            if group:
                offsets.append(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
        footer = Footer(start, start + len(summary), 0)
        return data_end + sealed(summary + record_bytes(*offsets), footer) + MAGIC
