"""Small logs with every kind of content, for the tests of the log."""

from collections import Counter
from collections.abc import Callable, Mapping
from math import prod
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from mjspace.contract import Array
from mjspace.log.encoding import Fields
from mjspace.log.schema import Scene
from mjspace.log.writer import LogWriter
from mjspace.units import Unit

TOPICS: dict[str, Fields] = {
    "/state": {"physics": (9,), "law_p": (2, 3), "sensor_none": (0,)},
    "/truth": {"attitude": (4,), "rate": (3,), "attitude_error": ()},
    "/law": {},
}
UNITS = {"/truth": {"attitude_error": Unit("rad")}}
METADATA = {"seed": "7", "integrator": "RK4", "note": "Grüße"}
ATTACHMENTS = {
    "scenario.toml": ("application/toml", b"duration = 1.0\n"),
    "empty": ("text/plain", b""),
}
SCENE = Scene(
    ("bus", "wheel_0"),
    SceneUpdate(entities=[SceneEntity(id="bus")]).SerializeToString(),
    "<robot name='mjspace'/>",
)
PERIODS_PER_SECOND = 1000
BLOCKS = (7, 100, 1, 60)  # control periods


def rows(first: int, count: int) -> tuple[Array, dict[str, dict[str, Array]]]:
    """Return ``count`` control periods from number ``first`` on: the same numbers in any blocks."""
    periods = np.arange(first, first + count)
    values = {
        topic: {
            field: np.sin(
                number * periods.reshape(count, *(1 for _ in shape))
                + np.arange(prod(shape)).reshape(shape)
            )
            for number, (field, shape) in enumerate(fields.items(), start=len(topic))
        }
        for topic, fields in TOPICS.items()
    }
    return periods / PERIODS_PER_SECOND, values


def create(path: Path) -> LogWriter:
    return LogWriter(path, TOPICS, METADATA, ATTACHMENTS, SCENE, UNITS)


def write_block(log: LogWriter, first: int, count: int) -> None:
    """Log a block as a flight does: frames every tenth period and an event, then the periods."""
    time, values = rows(first, count)
    frames = time[::10]
    axis = np.sin(frames)[:, None] * [0.36, 0.48, 0.8]
    turns = np.concatenate([np.cos(frames)[:, None], axis], axis=-1)
    places = np.stack([frames, -frames, 0 * frames], axis=-1)
    log.write_transforms(frames, np.stack([places, 2 * places], 1), np.stack([turns, -turns], 1))
    log.event(float(time[count // 2]), "WARNING", f"period {first + count // 2}")
    log.write(time, values)


def fly(path: Path) -> Path:
    """Write a whole log of ``BLOCKS`` to ``path`` and return it."""
    with create(path) as log:
        for i, count in enumerate(BLOCKS):
            write_block(log, sum(BLOCKS[:i]), count)
    return path


def rewritten(
    path: Path,
    out: Path,
    change: Callable[[str, int, bytes], bytes | None] = lambda topic, number, data: data,
    *,
    digests: bool = True,
    attachments: Mapping[str, bytes] = {},
    compression: CompressionType = CompressionType.ZSTD,
) -> Path:
    """Write the log at ``path`` anew with mcap's own writer, as another tool would; return ``out``.

    ``change`` gives each message's content, by its topic and its number on it, or None to leave it
    out; ``attachments``
    take the place of those of the same name, or are added.
    """
    numbers: Counter[str] = Counter()
    with path.open("rb") as source, out.open("wb") as target:
        reader, writer = make_reader(source), Writer(target, compression=compression)
        summary = reader.get_summary()
        assert summary is not None
        writer.start()
        schemas = {
            s.id: writer.register_schema(s.name, s.encoding, s.data)
            for s in summary.schemas.values()
        }
        channels = {
            c.id: writer.register_channel(
                c.topic, c.message_encoding, schemas[c.schema_id], c.metadata
            )
            for c in summary.channels.values()
        }
        for note in reader.iter_metadata():
            if digests or note.name == "mjspace":
                writer.add_metadata(note.name, note.metadata)
        for kept in reader.iter_attachments():
            data = attachments.get(kept.name, kept.data)
            writer.add_attachment(kept.create_time, kept.log_time, kept.name, kept.media_type, data)
        for name in attachments.keys() - {kept.name for kept in reader.iter_attachments()}:
            writer.add_attachment(0, 0, name, "text/plain", attachments[name])
        for _, channel, message in reader.iter_messages(log_time_order=False):
            changed = change(channel.topic, numbers[channel.topic], message.data)
            numbers[channel.topic] += 1
            if changed is None:
                continue
            writer.add_message(
                channels[channel.id],
                message.log_time,
                changed,
                message.publish_time,
                message.sequence,
            )
        writer.finish()
    return out
