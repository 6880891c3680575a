"""A chunk of the log: encoded messages in, Chunk, MessageIndex and ChunkIndex records out.

``mcap``'s own writer takes messages one by one: 5.6 us each, so 39 us for the seven of a control
period. Here a chunk's content comes as NumPy records, and the indexes follow from their strides:
1.6 us for the seven, of the thread that flies (a satellite's 280 numbers, blocks of 500 periods).
"""

import zlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex, Footer, Message
from numpy.typing import NDArray

Nanoseconds = NDArray[np.uint64]
INDEX = np.dtype([("time", "<u8"), ("offset", "<u8")])
"""An entry of a MessageIndex record."""

# 15 to 24 % smaller than level -5 for 1.2 to 1.9 us a row of the log's thread; level 1 takes 1.4 us
# more for another 3 %. benchmarks/log_size.py
LEVEL = -1


class Part(NamedTuple):
    """Consecutive messages of a chunk, and where in ``data`` each channel's are."""

    data: Any
    entries: dict[int, NDArray[np.void]]


def block(rows: NDArray[np.void], channels: Mapping[str, int], time: Nanoseconds) -> Part:
    """Return ``rows``, whose fields are topics, as the part of a chunk that they are."""
    index = {}
    for topic, channel in channels.items():
        entries = np.empty(len(rows), INDEX)
        entries["time"] = time
        entries["offset"] = rows.dtype.fields[topic][1] + rows.itemsize * np.arange(len(rows))  # type: ignore[index]
        index[channel] = entries
    return Part(rows.view(np.uint8), index)


def message(channel: int, time: int, data: bytes) -> Part:
    """Return one message, which is not counted, as a part of a chunk."""
    record = Message(channel, time, data, time, 0)
    return Part(record_bytes(record), {channel: np.array([(time, 0)], INDEX)})


def encode(parts: Sequence[Part], position: int) -> tuple[bytes, ChunkIndex, dict[int, int]]:
    """Return a chunk with its message indexes, to be written at ``position`` of the file.

    With it come its entry in the summary and its number of messages on each channel.
    """
    merged: dict[int, list[NDArray[np.void]]] = {}
    offset = 0
    for part in parts:
        for channel, entries in part.entries.items():
            moved = entries.copy()
            moved["offset"] += np.uint64(offset)
            merged.setdefault(channel, []).append(moved)
        offset += len(part.data)
    index = {channel: np.concatenate(entries) for channel, entries in merged.items()}
    start = min(int(entries["time"].min()) for entries in index.values())
    end = max(int(entries["time"].max()) for entries in index.values())

    content = b"".join(part.data for part in parts)
    # The frame's own checksum is the one that readers of ours check: it costs nothing.
    packed = zstandard.ZstdCompressor(level=LEVEL, write_checksum=True).compress(content)
    chunk = record_bytes(Chunk("zstd", packed, end, start, zlib.crc32(content), offset))

    records, offsets = [chunk], {}
    after = position + len(chunk)
    for channel, entries in index.items():
        offsets[channel] = after
        records.append(_index_record(channel, entries))
        after += len(records[-1])
    data = b"".join(records)
    chunk_index = ChunkIndex(
        chunk_length=len(chunk),
        chunk_start_offset=position,
        compression="zstd",
        compressed_size=len(packed),
        message_end_time=end,
        message_index_length=len(data) - len(chunk),
        message_index_offsets=offsets,
        message_start_time=start,
        uncompressed_size=offset,
    )
    return data, chunk_index, {channel: len(entries) for channel, entries in index.items()}


def sealed(summary: bytes, footer: Footer) -> bytes:
    """Return ``summary`` and ``footer`` with the checksum over both."""
    head = record_bytes(footer)[:-4]
    return summary + head + zlib.crc32(head, zlib.crc32(summary)).to_bytes(4, "little")


def record_bytes(*records: Any) -> bytes:
    """Return MCAP records as they stand in a file."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def _index_record(channel: int, entries: NDArray[np.void]) -> bytes:
    size = entries.nbytes
    head = np.array(
        (Opcode.MESSAGE_INDEX, 6 + size, channel, size),
        [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("size", "<u4")],
    )
    return head.tobytes() + entries.tobytes()
