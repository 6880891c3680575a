"""What lies where in a log's file, complete or cut short anywhere: a walk over its records."""

import io
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from struct import Struct
from typing import BinaryIO, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema

from mjspace.errors import InputError
from mjspace.log import digest
from mjspace.log.file import MAGIC, NAME
from mjspace.log.limits import refuse_bomb

RECORD = Struct("<BQ")
"""What a record begins with: opcode, length of the content that follows."""
SPAN = Struct("<QQ")
"""What a chunk's content begins with: the span of its stamps [ns]."""
_LONGEST_NAME = 4096  # bytes, of an attachment
_INDEX_HEAD = Struct("<HI")  # of a MessageIndex: its channel, and the size of its entries


class ChunkPlace(NamedTuple):
    """Where a chunk's content is, and the span of its stamps [ns]."""

    position: int
    size: int
    start: int
    end: int
    indexes: dict[int, int] | None
    """Position of each channel's MessageIndex; None where the file may end among them."""


class Inventory(NamedTuple):
    """All of a log but its messages and attachments, and where those are."""

    metadata: dict[str, str]
    digests: dict[str, str]
    attachments: dict[str, tuple[int, int]]
    """Position and size of each one's content."""
    schemas: dict[int, Schema]
    channels: dict[str, Channel]
    chunks: list[ChunkPlace]
    complete: bool


class Exactly(ReadDataStream):
    """What a record holds, which may claim more."""

    def read(self, length: int) -> bytes:
        """Return the next bytes; EndOfFile where there are fewer."""
        data = super().read(length)
        if len(data) < length:
            raise EndOfFile
        return data


def inventory(path: Path) -> Inventory:
    """Walk the records of a log up to its end, or to the first record that is not whole.

    Raises:
        OSError: the file cannot be read.
        InputError: it is not an MCAP file, not a log of mjspace, or damaged.
    """
    found = Inventory({}, {}, {}, {}, {}, [], complete=False)
    complete = False
    notes: set[str] = set()
    with path.open("rb", buffering=0) as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise InputError(f"{path} is not an MCAP file")
        for opcode, position, length in walk(file):
            try:
                _add(found, notes, file, opcode, position, length)
            except (McapError, ValueError, struct.error) as error:
                raise InputError(_damage(path, opcode, position, error, found.chunks)) from error
            if opcode == Opcode.DATA_END:
                file.seek(-len(MAGIC), io.SEEK_END)
                complete = file.read() == MAGIC
    if NAME not in notes:
        raise InputError(f"{path} is an MCAP file, but not a log of {NAME}")
    if not complete and found.chunks:
        found.chunks[-1] = found.chunks[-1]._replace(indexes=None)
    return found._replace(complete=complete)


def _add(
    found: Inventory, notes: set[str], file: BinaryIO, opcode: int, position: int, length: int
) -> None:
    """Add the record whose content is at ``position``, where the ``file`` is, to what is found."""
    if opcode == Opcode.MESSAGE_INDEX:
        indexes = found.chunks[-1].indexes if found.chunks else None
        if indexes is None:
            raise ValueError("it belongs to no chunk")
        channel, size = _INDEX_HEAD.unpack(file.read(_INDEX_HEAD.size))
        if _INDEX_HEAD.size + size != length:
            raise ValueError("its length is not that of its entries")
        indexes[channel] = position
    elif opcode == Opcode.CHUNK:
        start, end = SPAN.unpack(file.read(SPAN.size))
        found.chunks.append(ChunkPlace(position, length, start, end, {}))
    elif opcode == Opcode.SCHEMA:
        schema = Schema.read(Exactly(io.BytesIO(content(file, position, length))))
        if found.schemas.setdefault(schema.id, schema) != schema:
            raise ValueError(f"another schema has its number, {schema.id}")
    elif opcode == Opcode.CHANNEL:
        declared = Channel.read(Exactly(io.BytesIO(content(file, position, length))))
        if found.channels.setdefault(declared.topic, declared) != declared:
            raise ValueError("another channel is on its topic")
    elif opcode == Opcode.ATTACHMENT:
        name = attachment_name(file, position, length)
        if name in found.attachments:
            raise ValueError("another attachment has its name")
        found.attachments[name] = position, length
    elif opcode == Opcode.METADATA:
        note = Metadata.read(Exactly(io.BytesIO(content(file, position, length))))
        notes.add(note.name)
        if note.name == NAME:
            found.metadata.update(note.metadata)
        elif note.name == digest.RECORD:
            found.digests.update(note.metadata)


def _damage(
    path: Path, opcode: int, position: int, error: Exception, chunks: list[ChunkPlace]
) -> str:
    name = Opcode(opcode).name.lower().replace("_", " ")
    why = str(error) or "it ends too early"
    left = f"{len(chunks)} chunks come before it" if chunks else "no chunk comes before it"
    return (
        f"{path} is damaged: the {name} record at byte {position - RECORD.size} cannot be read: "
        f"{why}; {left}: 'mjspace recover' writes what can be saved"
    )


def content(file: BinaryIO, position: int, length: int) -> bytes:
    """Return the content of a whole record, which is not too much to read it at once.

    Raises:
        ValueError: it is too large for that.
    """
    refuse_bomb(length, length)
    file.seek(position)
    return file.read(length)


def attachment_name(file: BinaryIO, position: int, length: int) -> str:
    """Return the name of the attachment whose content is at ``position``.

    Raises:
        ValueError: it is not UTF-8, or not within the record.
    """
    file.seek(position + 16)
    size = int.from_bytes(file.read(4), "little")
    if 20 + size > length or size > _LONGEST_NAME:
        raise ValueError("its name is not within it, or too long")
    return file.read(size).decode()


def read_attachment(path: Path, name: str, position: int, length: int) -> bytes:
    """Return the data of the attachment whose content is at ``position``.

    Raises:
        InputError: it is damaged, or too large.
    """
    try:
        with path.open("rb") as file:
            return attachment(file, position, length).data
    except (McapError, ValueError, struct.error) as error:
        why = str(error) or "it ends too early"
        raise InputError(f"{path}: the attachment {name!r} is damaged: {why}") from error


def attachment(file: BinaryIO, position: int, length: int) -> Attachment:
    """Return the ``Attachment`` whose content is at ``position``.

    Raises:
        McapError, ValueError, struct.error: it is damaged, or too large.
    """
    attachment_name(file, position, length)
    data = content(file, position, length)
    stream = Exactly(io.BytesIO(data))
    attached: Attachment = Attachment.read(stream)
    checksum = int.from_bytes(data[-4:], "little")
    if stream.count != length or checksum not in (0, zlib.crc32(data[:-4])):
        raise ValueError("its checksum is wrong")
    return attached


def walk(file: BinaryIO, position: int = len(MAGIC)) -> Iterator[tuple[int, int, int]]:
    """Yield the opcode of each whole record, where its content is, and its length.

    The file is put there. The walk ends at a record that leads out of the file, and at zeros.
    """
    # The summary too: other writers put schemas and channels into chunks, and again only there.
    size = file.seek(0, io.SEEK_END)
    while True:
        file.seek(position)
        head = file.read(RECORD.size)
        if len(head) < RECORD.size:
            return
        opcode, length = RECORD.unpack(head)
        position += RECORD.size
        if not opcode or position + length > size:
            return
        yield opcode, position, length
        position += length
