"""What lies where in a log's file, complete or cut short anywhere: a walk over its records."""

import io
import struct
from collections.abc import Iterator
from pathlib import Path
from struct import Struct
from typing import BinaryIO, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema

from mjspace.log import digest
from mjspace.log.file import MAGIC, NAME

RECORD = Struct("<BQ")
"""What a record begins with: opcode, length of the content that follows."""


class ChunkPlace(NamedTuple):
    """Where a chunk's content is, and the span of its stamps [ns]."""

    position: int
    start: int
    end: int
    indexes: dict[int, int] | None
    """Position of each channel's MessageIndex; None where the file may end among them."""


class Inventory(NamedTuple):
    """All of a log but its messages and attachments, and where those are."""

    metadata: dict[str, str]
    digests: dict[str, str]
    attachments: dict[str, int]
    schemas: dict[int, Schema]
    channels: dict[str, Channel]
    chunks: list[ChunkPlace]
    complete: bool


def inventory(path: Path) -> Inventory:
    """Walk the records of a log up to its end, or to the first record that is not whole.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is not an MCAP file, not a log of mjspace, or damaged.
    """
    try:
        return _inventory(path)
    except (McapError, IndexError, struct.error, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is damaged: a record in it cannot be read") from error


def _inventory(path: Path) -> Inventory:
    found = Inventory({}, {}, {}, {}, {}, [], complete=False)
    ours = complete = False
    with path.open("rb", buffering=0) as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise ValueError(f"{path} is not an MCAP file")
        stream = ReadDataStream(file)
        for opcode, position in _walk(file):
            if opcode == Opcode.MESSAGE_INDEX:
                indexes = found.chunks[-1].indexes
                assert indexes is not None
                indexes[stream.read2()] = position
            elif opcode == Opcode.CHUNK:
                found.chunks.append(ChunkPlace(position, stream.read8(), stream.read8(), {}))
            elif opcode == Opcode.SCHEMA:
                schema = Schema.read(stream)
                found.schemas[schema.id] = schema
            elif opcode == Opcode.CHANNEL:
                channel = Channel.read(stream)
                found.channels[channel.topic] = channel
            elif opcode == Opcode.ATTACHMENT:
                file.seek(position + 16)
                found.attachments[stream.read_prefixed_string()] = position
            elif opcode == Opcode.METADATA:
                note = Metadata.read(stream)
                if note.name == NAME:
                    found.metadata.update(note.metadata)
                    ours = True
                elif note.name == digest.RECORD:
                    found.digests.update(note.metadata)
            elif opcode == Opcode.DATA_END:
                file.seek(-len(MAGIC), io.SEEK_END)
                complete = file.read() == MAGIC
    if not ours:
        raise ValueError(f"{path} is an MCAP file, but not a log of {NAME}")
    if not complete and found.chunks:
        found.chunks[-1] = found.chunks[-1]._replace(indexes=None)
    return found._replace(complete=complete)


def read_attachment(path: Path, position: int) -> bytes:
    """Return the data of the attachment whose content is at ``position``."""
    with path.open("rb") as file:
        file.seek(position)
        attached: Attachment = Attachment.read(ReadDataStream(file))
        return attached.data


def _walk(file: BinaryIO) -> Iterator[tuple[int, int]]:
    """Yield the opcode of each whole record, and where its content is, with the file put there."""
    # The summary too: other writers put schemas and channels into chunks, and again only there.
    size = file.seek(0, io.SEEK_END)
    position = len(MAGIC)
    while True:
        file.seek(position)
        head = file.read(RECORD.size)
        if len(head) < RECORD.size:
            return
        opcode, length = RECORD.unpack(head)
        position += RECORD.size
        if position + length > size:
            return
        yield opcode, position
        position += length
