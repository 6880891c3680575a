"""A log in parts that a test may change, and written again with every checksum and index right."""

import io
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import zstandard

from mjspace.log.content import records, unpacked
from mjspace.log.index import RECORD, ChunkPlace, walk

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, INDEX = range(1, 8)
CHUNK_INDEX, ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA = range(8, 13)
METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(13, 16)


@dataclass
class Parts:
    """A log: its records before the chunks, the messages of each chunk, its records after them."""

    before: list[tuple[int, bytes]] = field(default_factory=list)
    """Opcode and content."""
    chunks: list[list[bytes]] = field(default_factory=list)
    """Of each message its content: channel, sequence, times and data."""
    after: list[tuple[int, bytes]] = field(default_factory=list)

    def copy(self) -> "Parts":
        return Parts(list(self.before), [list(chunk) for chunk in self.chunks], list(self.after))


def parts_of(path: Path, chunks: int) -> Parts:
    """Return the parts of a whole log, its messages in about so many chunks."""
    found, messages = Parts(), []
    content = path.read_bytes()
    with path.open("rb") as file:
        for opcode, position, length in walk(file):
            data = content[position : position + length]
            if opcode == CHUNK:
                place = ChunkPlace(position, length, 0, 0, None)
                inner = unpacked(file, place)
                messages += [
                    inner[at + RECORD.size : at + RECORD.size + size]
                    for _, at, size in records(inner)
                ]
            elif opcode == DATA_END:
                break
            elif opcode != INDEX:
                (found.after if messages else found.before).append((opcode, data))
    messages.sort(key=lambda message: message[6:14][::-1])
    size = -(-len(messages) // chunks)
    found.chunks = [messages[i : i + size] for i in range(0, len(messages), size)]
    return found


def record(opcode: int, content: bytes) -> bytes:
    return RECORD.pack(opcode, len(content)) + content


def text(value: bytes) -> bytes:
    return struct.pack("<I", len(value)) + value


def attachment(name: bytes, data: bytes) -> bytes:
    content = (
        struct.pack("<QQ", 0, 0) + text(name) + text(b"") + struct.pack("<Q", len(data)) + data
    )
    return content + struct.pack("<I", zlib.crc32(content))


def name_of(content: bytes) -> bytes:
    """Return the name of an attachment."""
    size = int.from_bytes(content[16:20], "little")
    return content[20 : 20 + size]


def data_of(content: bytes) -> bytes:
    """Return the data of an attachment."""
    stream = io.BytesIO(content)
    stream.seek(16)
    for _ in range(2):
        stream.seek(int.from_bytes(stream.read(4), "little"), 1)
    return stream.read(int.from_bytes(stream.read(8), "little"))


def chunk(messages: list[bytes], packed: bytes | None = None, size: int | None = None) -> bytes:
    """Return a chunk and its message indexes."""
    content = b"".join(record(MESSAGE, message) for message in messages)
    times, at = [0], 0
    places: dict[int, list[bytes]] = {}
    for message in messages:
        if len(message) >= 14:
            time = int.from_bytes(message[6:14], "little")
            times.append(time)
            channel = int.from_bytes(message[:2], "little")
            places.setdefault(channel, []).append(struct.pack("<QQ", time, at))
        at += RECORD.size + len(message)
    stamps = times[1:] or times
    packed = zstandard.ZstdCompressor(level=1).compress(content) if packed is None else packed
    head = struct.pack("<QQQI", min(stamps), max(stamps), len(content) if size is None else size, 0)
    found = record(CHUNK, head + text(b"zstd") + struct.pack("<Q", len(packed)) + packed)
    for channel, entries in places.items():
        joined = b"".join(entries)
        found += record(INDEX, struct.pack("<HI", channel, len(joined)) + joined)
    return found


def pieces(log: Parts) -> Iterator[bytes]:
    """Yield the file in pieces: records, and chunks with their indexes."""
    yield from (record(*one) for one in log.before)
    yield from (chunk(messages) for messages in log.chunks)
    yield from (record(*one) for one in log.after)


def ending(log: Parts) -> bytes:
    """Return what follows: the end of the data, a summary, the footer."""
    repeated = b"".join(record(*one) for one in log.before if one[0] in (SCHEMA, CHANNEL))
    for opcode, content in log.before:
        if opcode == ATTACHMENT:
            numbers = struct.pack("<QQQQQ", 0, 0, 0, 0, 0)
            repeated += record(ATTACHMENT_INDEX, numbers + text(name_of(content)) + text(b""))
    return record(DATA_END, bytes(4)) + repeated + record(FOOTER, bytes(20)) + MAGIC


def joined(log: Parts) -> bytes:
    return MAGIC + b"".join(pieces(log)) + ending(log)
