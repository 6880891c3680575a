"""A chunk of a log read back: decompressed once, its messages as bytes or as rows of numbers."""

from collections.abc import Collection, Iterator, Mapping
from struct import Struct
from typing import Any, BinaryIO

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Chunk
from numpy.typing import NDArray

from mjspace.log.chunk import INDEX
from mjspace.log.index import RECORD, ChunkPlace

_MESSAGE = Struct("<BQH")  # opcode, length of the content that follows, channel


class Content:
    """The messages of a chunk on some channels."""

    def __init__(self, data: bytes, offsets: Mapping[int, NDArray[np.uint64]]) -> None:
        """Keep the chunk's ``data`` and where the records of each channel begin in it."""
        self._data = data
        self._offsets = offsets

    @property
    def channels(self) -> list[int]:
        """The channels that have messages."""
        return [channel for channel, offsets in self._offsets.items() if len(offsets)]

    def records(self, channel: int) -> list[bytes]:
        """Return the channel's Message records, each record whole."""
        data = self._data
        lengths = ((at, RECORD.unpack_from(data, at)[1]) for at in self._offsets[channel].tolist())
        return [data[at : at + RECORD.size + length] for at, length in lengths]

    def tails(self, channel: int, start: int) -> Any:
        """Return the channel's records one after the other, each from its byte ``start`` on."""
        first = int(self._offsets[channel][0])
        try:
            records = self._equal(channel, RECORD.size + RECORD.unpack_from(self._data, first)[1])
        except ValueError:
            return b"".join(record[start:] for record in self.records(channel))
        return np.ascontiguousarray(records[:, start:]).data

    def rows(self, channel: int, dtype: np.dtype[np.void]) -> NDArray[np.void]:
        """Return the channel's records as rows of ``dtype``, shape (n,); n > 0.

        Raises:
            ValueError: a record of another length.
        """
        rows: NDArray[np.void] = self._equal(channel, dtype.itemsize).view(dtype)[:, 0]
        return rows

    def _equal(self, channel: int, size: int) -> NDArray[np.uint8]:
        """Return the channel's records, shape (n, size), n > 0, which are all ``size`` bytes long.

        They are a view of the chunk where they stand at equal distances, as mjspace writes them.

        Raises:
            ValueError: a record of another length.
        """
        offsets = self._offsets[channel].astype(np.int64)
        if offsets.max() + size > len(self._data):
            raise ValueError("a record leads out of its chunk")
        steps = set(np.diff(offsets).tolist()) or {size}
        if len(steps) == 1:
            shape, strides = (len(offsets), size), (*steps, 1)
            found = np.ndarray(shape, np.uint8, self._data, int(offsets[0]), strides)
        else:
            data = b"".join(self._data[at : at + size] for at in offsets.tolist())
            found = np.frombuffer(data, np.uint8).reshape(-1, size)
        lengths = found[:, 1 : RECORD.size].view("<u8")[:, 0]
        if (lengths != size - RECORD.size).any():
            raise ValueError("a record of another length")
        return found


def read_content(file: BinaryIO, place: ChunkPlace, channels: Collection[int]) -> Content:
    """Return the chunk's content on those of ``channels`` that it has.

    Raises:
        ValueError: the chunk is damaged, or compressed by another method than zstd.
    """
    if place.indexes is not None:
        channels = [channel for channel in channels if channel in place.indexes]
        if not channels:
            return Content(b"", {})
    file.seek(place.position)
    chunk = Chunk.read(ReadDataStream(file))
    if chunk.compression not in ("", "zstd"):
        raise ValueError(f"compression {chunk.compression!r}: write the log anew with zstd")
    data = chunk.data
    if chunk.compression:
        try:
            data = zstandard.decompress(data, max_output_size=chunk.uncompressed_size)
        except zstandard.ZstdError as error:
            raise ValueError(f"the chunk at byte {place.position} is damaged: {error}") from None
    if place.indexes is None:
        return Content(data, _walked(data, channels))
    offsets = {channel: _indexed(file, place.indexes[channel]) for channel in channels}
    if any(int(at.max()) + RECORD.size > len(data) for at in offsets.values() if len(at)):
        raise ValueError(f"the index of the chunk at byte {place.position} is damaged")
    return Content(data, offsets)


def _indexed(file: BinaryIO, position: int) -> NDArray[np.uint64]:
    """Return the offsets in the MessageIndex whose content is at ``position``."""
    file.seek(position + 2)
    size = int.from_bytes(file.read(4), "little")
    return np.frombuffer(file.read(size), INDEX)["offset"]


def _walked(data: bytes, channels: Collection[int]) -> dict[int, NDArray[np.uint64]]:
    """Return the offsets of each channel's messages, found from record to record."""
    offsets: dict[int, list[int]] = {channel: [] for channel in channels}
    for at, channel in _messages(data):
        if channel in offsets:
            offsets[channel].append(at)
    return {channel: np.array(places, np.uint64) for channel, places in offsets.items()}


def _messages(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield where each message of a chunk's content is, and its channel."""
    at = 0
    while at < len(data):
        opcode, length, channel = _MESSAGE.unpack_from(data, at)
        if opcode == Opcode.MESSAGE:
            yield at, channel
        at += RECORD.size + length
