"""What a flight and a law in another process say to each other: protobuf, length first.

Each message is preceded by its length in bytes, an unsigned number of four bytes, the least
significant first. The law speaks first, so that nothing is sent to what is no law: ``Greeting``.
The flight answers ``Begin``, and the law ``Answer``, with an error or empty. Then each ``Call``
of the flight has one ``Answer``. What is measured, desired, remembered, commanded and signalled are
messages of doubles as the log has them, field i the i-th of those that were declared.
"""

import socket
import time
from collections.abc import Mapping, Sequence
from math import prod
from typing import Any, Self

import numpy as np
from google.protobuf.descriptor_pb2 import (
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError
from google.protobuf.message_factory import GetMessageClass

from mjspace.contract import Array
from mjspace.log.encoding import doubles
from mjspace.log.limits import ROW
from mjspace.log.schema import file_of
from mjspace.simulation.flight_software.interface import Field, Fields

PROTOCOL = "mjspace law"
VERSION = 1
MOST = 1 << 24
"""Bytes of a message."""

_TYPES = {
    "bool": FieldDescriptorProto.TYPE_BOOL,
    "bytes": FieldDescriptorProto.TYPE_BYTES,
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "string": FieldDescriptorProto.TYPE_STRING,
    "uint32": FieldDescriptorProto.TYPE_UINT32,
}
ENVELOPES: Mapping[str, Mapping[str, str]] = {
    "Field": {
        "name": "string",
        "shape": "repeated uint32",
        "unit": "string",
        "about": "string",
        "measures": "string",
    },
    "Greeting": {"protocol": "string", "version": "uint32"},
    "Begin": {
        "gains": "string",
        "vehicle_fields": "repeated Field",
        "measurement_fields": "repeated Field",
        "reference_fields": "repeated Field",
        "command_fields": "repeated Field",
        "descriptors": "bytes",
        "vehicle": "Vehicle",
    },
    "Call": {
        "reset": "bool",
        "time": "double",
        "measurement": "Measurement",
        "reference": "Reference",
        "state": "bytes",
    },
    "Answer": {
        "error": "string",
        "state": "bytes",
        "command": "Command",
        "signals": "bytes",
        "state_fields": "repeated Field",
        "command_fields": "repeated Field",
        "signals_fields": "repeated Field",
    },
}
"""The messages, and the types of their fields, which are numbered from 1. A message within another
is on the wire what ``bytes`` are."""


def _classes() -> dict[str, Any]:
    """Return the classes of the messages."""
    file = FileDescriptorProto(name="mjspace/law.proto", package="mjspace.law", syntax="proto3")
    for name, fields in ENVELOPES.items():
        message = file.message_type.add(name=name)
        for number, (field, text) in enumerate(fields.items(), start=1):
            label, _, kind = text.rpartition(" ")
            declared = message.field.add(name=field, number=number)
            declared.label = (
                FieldDescriptorProto.LABEL_REPEATED
                if label
                else FieldDescriptorProto.LABEL_OPTIONAL
            )
            declared.type = _TYPES.get(kind, FieldDescriptorProto.TYPE_BYTES)
            if kind == "Field":
                declared.type = FieldDescriptorProto.TYPE_MESSAGE
                declared.type_name = ".mjspace.law.Field"
    pool = DescriptorPool()
    pool.Add(file)
    return {name: _class_in(pool, f"mjspace.law.{name}") for name in ENVELOPES}


def _class_in(pool: DescriptorPool, name: str) -> Any:
    return GetMessageClass(pool.FindMessageTypeByName(name))


CLASSES = _classes()


class PeerError(Exception):
    """What is at the other end of the socket is gone, late, or says what it must not."""


class ClosedError(PeerError):
    """The other end closed the connection."""


class Numbers:
    """The message of doubles of a group of fields, as the log has it."""

    def __init__(self, message: str, fields: Fields) -> None:
        """Prepare the ``message`` of that name.

        Raises:
            ValueError: a field's name cannot be logged.
        """
        self.fields, self._message = fields, message
        self._shapes = {name: field.shape for name, field in fields.items()}
        self._layout = doubles(self._shapes)
        self.file = file_of(f"mjspace.{message}", self._shapes)
        # On the wire fields have numbers: whatever they are called, they are read as f0, f1, ....
        numbered = {f"f{n}": shape for n, shape in enumerate(self._shapes.values())}
        pool = DescriptorPool()
        pool.Add(file_of(f"mjspace.{message}", numbered))
        self._class = _class_in(pool, f"mjspace.{message}")

    def encode(self, arrays: Sequence[Any]) -> bytes:
        """Return the message of these arrays, in the order of the fields."""
        if not self._shapes:
            return b""
        row = self._layout.rows(1)[0]
        for name, array in zip(self._shapes, arrays, strict=True):
            row[name] = array
        return bytes(row.tobytes())

    def decode(self, data: bytes) -> list[Array]:
        """Return the arrays of a message.

        Raises:
            PeerError: it is no such message, or an array has another size.
        """
        if data and not self._shapes:
            raise PeerError(f"sent a {self._message}, and has declared no field of it")
        try:
            message = self._class.FromString(data)
        except DecodeError:
            raise PeerError(f"sent a damaged {self._message}") from None
        found = []
        for number, (name, shape) in enumerate(self._shapes.items()):
            array = np.array(getattr(message, f"f{number}"), dtype=float)
            if array.size != prod(shape):
                raise PeerError(
                    f"sent {array.size} numbers as {name} of its {self._message}, should be "
                    f"{prod(shape)}"
                )
            found.append(array.reshape(shape))
        return found


def declared(fields: Fields) -> list[Any]:
    """Return the ``Field`` messages that declare the fields."""
    return [CLASSES["Field"](name=name, **field._asdict()) for name, field in fields.items()]


def fields_in(messages: Sequence[Any]) -> dict[str, Field]:
    """Return the fields that ``Field`` messages declare.

    Raises:
        PeerError: two have one name, or they are larger than a log's row may be.
    """
    found = {m.name: Field(tuple(m.shape), m.unit, m.about, m.measures) for m in messages}
    if len(found) < len(messages):
        raise PeerError("declares two fields of one name")
    if sum(8 * prod(field.shape) for field in found.values()) > ROW:
        raise PeerError(f"declares fields of more than {ROW} bytes")
    return found


def descriptors(groups: Sequence[Numbers]) -> bytes:
    """Return the serialized FileDescriptorSet of the messages of doubles."""
    return FileDescriptorSet(file=[group.file for group in groups]).SerializeToString()


class Connection:
    """A socket on which messages go to and fro; closed with its context, or by ``close``."""

    def __init__(self, opened: socket.socket) -> None:
        self._socket = opened
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, message: Any) -> None:
        """Send a message.

        Raises:
            PeerError: the other end is gone.
        """
        data = message.SerializeToString()
        try:
            self._socket.sendall(len(data).to_bytes(4, "little") + data)
        except OSError as error:
            raise PeerError(f"is gone: {error}") from error

    def receive(self, name: str, within: float | None = None) -> Any:
        """Return the next message, one of that ``name``.

        Raises:
            PeerError: there is none ``within`` so many seconds, or it is damaged; or the other end
                is gone.
        """
        due = None if within is None else time.monotonic() + within
        try:
            length = int.from_bytes(self._exactly(4, due), "little")
            if length > MOST:
                raise PeerError(f"sent no {name}, but what would have {length} bytes")
            return CLASSES[name].FromString(self._exactly(length, due))
        except TimeoutError:
            raise PeerError(f"has not sent its {name} within {within:g} s") from None
        except OSError as error:
            raise PeerError(f"is gone: {error}") from error
        except DecodeError:
            raise PeerError(f"sent a damaged {name}") from None

    def close(self) -> None:
        """Close it."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def _exactly(self, count: int, due: float | None) -> bytes:
        """Return so many bytes; ``due`` is when they must be there."""
        data = bytearray()
        while len(data) < count:
            left = None if due is None else due - time.monotonic()
            if left is not None and left <= 0.0:
                raise TimeoutError
            self._socket.settimeout(left)
            received = self._socket.recv(count - len(data))
            if not received:
                raise ClosedError("closed the connection")
            data += received
        return bytes(data)
