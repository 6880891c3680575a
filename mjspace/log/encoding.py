"""The bytes of a message in the log: protobuf of fixed size, which a NumPy record describes.

A packed ``repeated double`` of known length has a constant tag and a constant length before its
numbers. The bytes of every message of a topic are therefore one template, and its numbers are the
fields of a structured dtype whose gaps are the template: a whole block of messages is encoded or
decoded by assigning columns.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

Fields = Mapping[str, tuple[int, ...]]
"""Names and array shapes of a message's fields, in their order."""
HEADER = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log_time", "<u8"),
        ("publish_time", "<u8"),
    ]
)
"""What stands before each message: MCAP's record header and Message fields, packed."""

_DOUBLE, _BYTES = 1, 2  # protobuf wire types
_STAMP = b"\x08" + bytes(5) + b"\x10" + bytes(5)  # google.protobuf.Timestamp, both varints padded


@dataclass(frozen=True)
class Layout:
    """The bytes of a message with its numbers left zero, and where the numbers go."""

    template: bytes
    dtype: np.dtype[np.void]

    def record(self, channel: int) -> "Layout":
        """Return the layout of a whole MCAP Message record: fields ``header`` and ``message``."""
        header = np.zeros((), HEADER)
        header["opcode"] = Opcode.MESSAGE
        header["length"] = HEADER.itemsize - 9 + len(self.template)
        header["channel"] = channel
        return Layout(
            header.tobytes() + self.template,
            np.dtype([("header", HEADER), ("message", self.dtype)]),
        )

    def rows(self, count: int) -> NDArray[np.void]:
        """Return ``count`` writable copies of the template, shape (count,)."""
        return np.frombuffer(bytearray(self.template) * count, self.dtype)


def side_by_side(layouts: Mapping[str, Layout]) -> Layout:
    """Return the layout of one record of each topic after another; its fields are the topics."""
    return Layout(
        b"".join(layout.template for layout in layouts.values()),
        np.dtype([(topic, layout.dtype) for topic, layout in layouts.items()]),
    )


def doubles(fields: Fields) -> Layout:
    """Return the layout of a message with one array field for each name, numbered from 1.

    Raises:
        ValueError: a name is not a protobuf identifier, or is ``time``, which the reader adds.
    """
    template, offsets = b"", []
    for number, (name, shape) in enumerate(fields.items(), start=1):
        if not (name.isidentifier() and name.isascii()) or name == "time":
            raise ValueError(f"{name!r} cannot name a logged field: write a word other than 'time'")
        size = 8 * prod(shape)
        template += _tag(number, _BYTES) + _varint(size) if shape else _tag(number, _DOUBLE)
        offsets.append(len(template))
        template += bytes(size)
    return _layout(template, {name: ("<f8", shape) for name, shape in fields.items()}, offsets)


def transforms(bodies: Sequence[str]) -> Layout:
    """Return the layout of a ``foxglove.FrameTransforms`` from ``world`` to each body.

    Its fields, for body i: ``seconds_i`` and ``nanoseconds_i`` (``varint5``), ``position_i`` and
    ``quaternion_i`` (x, y, z, w), whose numbers are under ``value``.
    """
    template, offsets = b"", []
    formats: dict[str, Any] = {}
    coordinate = np.dtype([("tag", "u1"), ("value", "<f8")])
    for i, body in enumerate(bodies):
        start = _tag(1, _BYTES) + _varint(len(_STAMP))
        frames = _text(2, "world") + _text(3, body)
        head = start + _STAMP + frames + _tag(4, _BYTES) + _varint(27)
        middle = _vector(3) + _tag(5, _BYTES) + _varint(36)
        content = head + middle + _vector(4)
        template += _tag(1, _BYTES) + _varint(len(content))
        begin = len(template)
        template += content
        formats |= {
            f"seconds_{i}": ("u1", (5,)),
            f"nanoseconds_{i}": ("u1", (5,)),
            f"position_{i}": (coordinate, (3,)),
            f"quaternion_{i}": (coordinate, (4,)),
        }
        stamp = begin + len(start)
        offsets += [stamp + 1, stamp + 7, begin + len(head), begin + len(head + middle)]
    return _layout(template, formats, offsets)


def location(frame: str) -> Layout:
    """Return the layout of a ``foxglove.LocationFix`` of the frame of that name.

    Its fields are ``seconds`` and ``nanoseconds`` (``varint5``) and ``place``: latitude [deg],
    longitude [deg] and altitude [m], whose numbers are under ``value``.
    """
    coordinate = np.dtype([("tag", "u1"), ("value", "<f8")])
    head = _tag(6, _BYTES) + _varint(len(_STAMP))
    middle = head + _STAMP + _text(7, frame)
    formats = {
        "seconds": ("u1", (5,)),
        "nanoseconds": ("u1", (5,)),
        "place": (coordinate, (3,)),
    }
    return _layout(middle + _vector(3), formats, [len(head) + 1, len(head) + 7, len(middle)])


def varint5(values: NDArray[np.uint64]) -> NDArray[np.uint8]:
    """Return numbers below 2^35, shape (n,), as protobuf varints padded to five bytes, (n, 5)."""
    digits = (values[:, None] >> np.arange(5, dtype=np.uint64) * np.uint64(7)) & np.uint64(0x7F)
    digits[:, :4] |= np.uint64(0x80)
    return digits.astype(np.uint8)


def _layout(template: bytes, formats: Mapping[str, Any], offsets: Sequence[int]) -> Layout:
    names = list(formats)
    shape = {"names": names, "formats": list(formats.values()), "offsets": list(offsets)}
    return Layout(template, np.dtype({**shape, "itemsize": len(template)}))  # type: ignore[call-overload]


def _tag(number: int, wire_type: int) -> bytes:
    return _varint(number << 3 | wire_type)


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def _text(number: int, text: str) -> bytes:
    encoded = text.encode()
    return _tag(number, _BYTES) + _varint(len(encoded)) + encoded


def _vector(length: int) -> bytes:
    return b"".join(_tag(number, _DOUBLE) + bytes(8) for number in range(1, length + 1))
