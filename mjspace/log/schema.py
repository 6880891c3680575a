"""What the log holds: its topics, with the schemas that explain them to any reader."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.descriptor import FileDescriptor
from google.protobuf.descriptor_pb2 import (
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from mcap.records import Channel, Schema

from mjspace.log.encoding import Fields
from mjspace.units import Unit

PERIODIC = {
    "/state": "mjspace.State",
    "/truth": "mjspace.Truth",
    "/measurement": "mjspace.Measurement",
    "/reference": "mjspace.Reference",
    "/command": "mjspace.Command",
    "/law": "mjspace.LawSignals",
    "/disturbance": "mjspace.Disturbance",
}
"""Topics with a row at every control period, or every n-th, with their messages' names."""

_FOXGLOVE: dict[str, Any] = {"/tf": FrameTransforms, "/scene": SceneUpdate, "/events": Log}


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
) -> tuple[list[Schema], list[Channel]]:
    """Return the records that declare ``topics``, then /tf, /scene, /events and /robot_description.

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
        declare(topic, PERIODIC[topic], "protobuf", _descriptor(PERIODIC[topic], fields), metadata)
    for topic, message in _FOXGLOVE.items():
        described = message.DESCRIPTOR
        declare(topic, described.full_name, "protobuf", _descriptor_of(described.file), {})
    declare("/robot_description", "std_msgs/msg/String", "ros2msg", b"string data", {})
    return schemas, declared


def _descriptor(message: str, fields: Fields) -> bytes:
    """Return the serialized FileDescriptorSet of an mjspace message: ``double`` for shape ()."""
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
    return FileDescriptorSet(file=[file]).SerializeToString()


def _descriptor_of(file: FileDescriptor) -> bytes:
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


def field_names(schema: bytes) -> list[str]:
    """Return the field names of a FileDescriptorSet's one message, in their numbers' order."""
    message = FileDescriptorSet.FromString(schema).file[0].message_type[0]
    return [field.name for field in sorted(message.field, key=lambda field: field.number)]
