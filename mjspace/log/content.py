"""A chunk of a log read back: decompressed once, its messages as bytes or as rows of numbers."""

import zlib
from collections.abc import Collection, Iterator, Mapping
from struct import Struct
from typing import Any, BinaryIO

import numpy as np
import zstandard
from mcap.opcode import Opcode
from numpy.typing import NDArray

from mjspace.log.chunk import INDEX
from mjspace.log.encoding import HEADER
from mjspace.log.index import RECORD, ChunkPlace
from mjspace.log.limits import refuse_bomb

_CHUNK = Struct("<QQQII")
"""What a chunk begins with: span of stamps, size and checksum of its records, length of a name."""


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
        """Return the channel's Message records, each record whole.

        Raises:
            ValueError: one leads into the next, or out of the chunk.
        """
        data, begins = self._data, self._offsets[channel].tolist()
        ends = [at + RECORD.size + RECORD.unpack_from(data, at)[1] for at in begins]
        if any(end > limit for end, limit in zip(ends, [*begins[1:], len(data)], strict=True)):
            raise ValueError("a record leads out of its place")
        return [data[at:end] for at, end in zip(begins, ends, strict=True)]

    def tails(self, channel: int, start: int) -> Any:
        """Return the channel's records one after the other, each from its byte ``start`` on.

        Raises:
            ValueError: a record leads into the next, or out of the chunk.
        """
        first = int(self._offsets[channel][0])
        try:
            records = self._equal(channel, RECORD.size + RECORD.unpack_from(self._data, first)[1])
        except ValueError:
            return b"".join(record[start:] for record in self.records(channel))
        return np.ascontiguousarray(records[:, start:]).data

    def rows(self, channel: int, dtype: np.dtype[np.void]) -> NDArray[np.void]:
        """Return the channel's records as rows of ``dtype``, shape (n,); n > 0.

        Raises:
            ValueError: a record of another length, of another channel or of another kind.
        """
        rows: NDArray[np.void] = self._equal(channel, dtype.itemsize).view(dtype)[:, 0]
        header = rows["header"]
        if (header["opcode"] != Opcode.MESSAGE).any() or (header["channel"] != channel).any():
            raise ValueError("the index leads to something else")
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
        if min(steps) < size:
            raise ValueError("a record of another length")
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
    data = unpacked(file, place)
    if place.indexes is None:
        return Content(data, message_offsets(data, channels))
    offsets = {channel: _indexed(file, place.indexes[channel]) for channel in channels}
    for at in offsets.values():
        leads_out = len(at) and int(at[-1]) + HEADER.itemsize > len(data)
        if leads_out or (at[1:] <= at[:-1]).any():
            raise ValueError("its index is damaged")
    return Content(data, offsets)


def unpacked(file: BinaryIO, place: ChunkPlace) -> bytes:
    """Return the records in a chunk.

    Raises:
        ValueError: the chunk is damaged, or compressed by another method than zstd.
    """
    file.seek(place.position)
    head = file.read(min(_CHUNK.size, place.size))
    if len(head) < _CHUNK.size:
        raise ValueError("it is too short")
    *_, size, checksum, length = _CHUNK.unpack(head)
    method = file.read(min(length, place.size - _CHUNK.size))
    packed = place.size - _CHUNK.size - len(method) - 8
    if method not in (b"", b"zstd"):
        name = method[:20].decode(errors="replace")
        raise ValueError(f"compression {name!r}: write the log anew with zstd")
    if packed < 0 or int.from_bytes(file.read(8), "little") != packed:
        raise ValueError("its length is not that of its records")
    refuse_bomb(packed, packed)
    data = file.read(packed)
    if not method:
        if packed != size or checksum not in (0, zlib.crc32(data)):
            raise ValueError("its checksum is wrong")
        return data
    refuse_bomb(size, packed)
    try:
        claimed = zstandard.frame_content_size(data)
        if claimed not in (-1, size):
            raise ValueError("its two sizes differ")
        data = zstandard.decompress(data, max_output_size=size)
    except zstandard.ZstdError as error:
        raise ValueError(str(error)) from None
    if len(data) != size:
        raise ValueError("it unpacks to another size")
    return data


def _indexed(file: BinaryIO, position: int) -> NDArray[np.uint64]:
    """Return the offsets in the MessageIndex whose content is at ``position``."""
    file.seek(position + 2)
    size = int.from_bytes(file.read(4), "little")
    if size % INDEX.itemsize:
        raise ValueError("its index is damaged")
    return np.frombuffer(file.read(size), INDEX)["offset"]


def message_offsets(data: bytes, channels: Collection[int]) -> dict[int, NDArray[np.uint64]]:
    """Return the offsets of each channel's messages, found from record to record.

    Raises:
        ValueError: a record leads out of the chunk, or is too short for a message.
    """
    offsets: dict[int, list[int]] = {channel: [] for channel in channels}
    for at, channel in messages(data):
        if channel in offsets:
            offsets[channel].append(at)
    return {channel: np.array(places, np.uint64) for channel, places in offsets.items()}


def messages(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield where each message of a chunk's content is, and its channel.

    Raises:
        ValueError: a record leads out of the chunk, or is too short for a message.
    """
    for opcode, at, length in records(data):
        if opcode == Opcode.MESSAGE:
            if length < HEADER.itemsize - RECORD.size:
                raise ValueError("it holds a message that is too short")
            yield at, int.from_bytes(data[at + RECORD.size : at + RECORD.size + 2], "little")


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield the opcode of each record of a chunk's content, where it begins, and its length.

    Raises:
        ValueError: a record leads out of the chunk.
    """
    at = 0
    while at < len(data):
        if at + RECORD.size > len(data):
            raise ValueError("its last record is not whole")
        opcode, length = RECORD.unpack_from(data, at)
        if at + RECORD.size + length > len(data):
            raise ValueError("a record leads out of it")
        yield opcode, at, length
        at += RECORD.size + length
