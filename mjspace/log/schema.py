"""What the log holds: its topics, with the schemas that explain them to any reader."""

from collections.abc import Mapping
from math import prod
from typing import Any, NamedTuple

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LocationFix_pb2 import LocationFix
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.descriptor import FileDescriptor
from google.protobuf.descriptor_pb2 import (
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from google.protobuf.message import DecodeError
from mcap.records import Channel, Schema

from mjspace.log.encoding import Fields
from mjspace.log.limits import ROW
from mjspace.units import Unit

PERIODIC = {
    "/state": "mjspace.State",
    "/truth": "mjspace.Truth",
    "/measurement": "mjspace.Measurement",
    "/estimate": "mjspace.Estimate",
    "/reference": "mjspace.Reference",
    "/command": "mjspace.Command",
    "/law": "mjspace.LawSignals",
    "/disturbance": "mjspace.Disturbance",
}
"""Topics with a row at every control period, or every n-th, with their messages' names."""

_FOXGLOVE: dict[str, Any] = {
    "/tf": FrameTransforms,
    "/scene": SceneUpdate,
    "/events": Log,
    "/location": LocationFix,
}


Shapes = dict[str, tuple[int, ...]]
"""Of a topic's fields, by name."""


class Scene(NamedTuple):
    """What a viewer draws: frames on /tf by body, and the geometry in those frames, twice."""

    bodies: tuple[str, ...]
    """Names of the bodies whose frames are logged, all children of ``world``."""
    update: bytes
    """A serialized ``foxglove.SceneUpdate``."""
    urdf: str
    """The same geometry as URDF."""


def channels(
    topics: Mapping[str, Fields],
    units: Mapping[str, Mapping[str, Unit]],
    every: Mapping[str, int] = {},
    *,
    located: bool = False,
) -> tuple[list[Schema], list[Channel]]:
    """Return the records that declare ``topics``, then /tf, /scene, /events and /robot_description.

    With ``located`` /location is declared before the last.

    A periodic channel's metadata has, of each field, ``shape.<field>`` ("9,9"; empty for a number)
    and, where ``units`` has one, ``unit.<field>``; and ``every``, the number of control periods
    from one row to the next, where that is not 1.

    Raises:
        ValueError: a topic that the log does not have.
    """
    schemas: list[Schema] = []
    declared: list[Channel] = []

    def declare(
        topic: str, name: str, encoding: str, data: bytes, metadata: dict[str, str]
    ) -> None:
        number = len(declared) + 1
        ros = encoding == "ros2msg"
        schemas.append(Schema(number, data, encoding, name))
        declared.append(Channel(number, topic, "cdr" if ros else encoding, metadata, number))

    for topic, fields in topics.items():
        if topic not in PERIODIC:
            raise ValueError(f"no topic {topic!r}: have {', '.join(PERIODIC)}")
        metadata = {f"shape.{name}": ",".join(map(str, shape)) for name, shape in fields.items()}
        known = units.get(topic, {})
        metadata |= {f"unit.{name}": known[name].si for name in fields if name in known}
        if every.get(topic, 1) != 1:
            metadata["every"] = str(every[topic])
        declare(topic, PERIODIC[topic], "protobuf", descriptor(PERIODIC[topic], fields), metadata)
    for topic, message in _FOXGLOVE.items():
        if topic == "/location" and not located:
            continue
        described = message.DESCRIPTOR
        declare(topic, described.full_name, "protobuf", descriptor_of(described.file), {})
    declare("/robot_description", "std_msgs/msg/String", "ros2msg", b"string data", {})
    return schemas, declared


def descriptor(message: str, fields: Fields) -> bytes:
    """Return the serialized FileDescriptorSet of an mjspace message: ``double`` for shape ()."""
    return FileDescriptorSet(file=[file_of(message, fields)]).SerializeToString()


def file_of(message: str, fields: Fields) -> FileDescriptorProto:
    """Return the descriptor of the file of an mjspace message, without its set."""
    package, _, name = message.partition(".")
    file = FileDescriptorProto(name=f"{package}/{name}.proto", package=package, syntax="proto3")
    proto = file.message_type.add(name=name)
    for number, (field, shape) in enumerate(fields.items(), start=1):
        proto.field.add(
            name=field,
            number=number,
            type=FieldDescriptorProto.TYPE_DOUBLE,
            label=FieldDescriptorProto.LABEL_REPEATED
            if shape
            else FieldDescriptorProto.LABEL_OPTIONAL,
        )
    return file


def descriptor_of(file: FileDescriptor) -> bytes:
    """Return the serialized FileDescriptorSet of a compiled .proto file and all that it imports."""
    found: dict[str, FileDescriptorProto] = {}

    def add(file: FileDescriptor) -> None:
        for imported in file.dependencies:
            add(imported)
        proto = FileDescriptorProto()
        file.CopyToProto(proto)
        found.setdefault(file.name, proto)

    add(file)
    return FileDescriptorSet(file=found.values()).SerializeToString()


def declared(channel: Channel, schema: Schema | None) -> tuple[Shapes, dict[str, str], int]:
    """Return what a periodic channel of a log declares: shapes, units, ``every``.

    Raises:
        ValueError: it is not declared as mjspace does.
    """
    name = PERIODIC[channel.topic]
    found = None if schema is None else (channel.message_encoding, schema.encoding, schema.name)
    if schema is None or found != ("protobuf", "protobuf", name):
        has = "none" if found is None else ", ".join(map(repr, found))
        raise ValueError(f"its message is not {name} in protobuf, but {has:.80}")
    every = _natural(channel.metadata.get("every", "1"), "every")
    if every == 0:
        raise ValueError("its metadata have every = 0, should be at least 1")
    shapes = {field: _shape(channel, field) for field in _field_names(schema, name)}
    size = sum(8 * prod(shape) for shape in shapes.values())
    if size > ROW:
        raise ValueError(f"its row has {size} bytes, more than {ROW}")
    units = {field: channel.metadata.get(f"unit.{field}", "") for field in shapes}
    return shapes, {field: unit for field, unit in units.items() if unit}, every


def _shape(channel: Channel, field: str) -> tuple[int, ...]:
    sizes = channel.metadata.get(f"shape.{field}")
    if sizes is None:
        raise ValueError(f"its metadata lack shape.{field}")
    return tuple(_natural(size, f"shape.{field}") for size in sizes.split(",") if size)


def _natural(text: str, key: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        raise ValueError(f"its metadata have {key} = {text[:20]!r}, not a whole number")
    return int(text)


def _field_names(schema: Schema, name: str) -> list[str]:
    """Return the names of the fields of a message of doubles, numbered from 1 in their order.

    Raises:
        ValueError: the schema is not a FileDescriptorSet of such a message.
    """
    try:
        found = FileDescriptorSet.FromString(schema.data)
    except DecodeError:
        found = FileDescriptorSet()
    kinds = [kind for file in found.file for kind in file.message_type]
    fields = sorted(kinds[0].field, key=lambda field: field.number) if len(kinds) == 1 else []
    good = len(kinds) == 1 and all(
        field.number == number and field.type == FieldDescriptorProto.TYPE_DOUBLE
        for number, field in enumerate(fields, start=1)
    )
    names = [field.name for field in fields]
    if not good or len(set(names)) < len(names):
        raise ValueError(f"its schema {name} is not a message of numbers")
    return names
