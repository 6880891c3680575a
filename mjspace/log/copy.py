"""A copy of a log with further topics: what is derived from it, for viewers."""

import heapq
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from mjspace.errors import InputError
from mjspace.log.schema import descriptor_of


def copy_with(
    source: Path, file: BinaryIO, kinds: Mapping[str, Any], added: Iterable[tuple[str, int, bytes]]
) -> None:
    """Write ``source`` to ``file`` with ``added``: topic, stamp [ns] and message, in order of time.

    ``kinds`` are the classes of the added topics' protobuf messages. Every message, attachment and
    metadata record of the log is copied as it is.

    Raises:
        InputError: the log has one of these topics already, or has no summary, as one cut short.
    """
    writer = Writer(file, compression=CompressionType.ZSTD)
    with source.open("rb") as opened:
        reader = make_reader(opened)
        summary = reader.get_summary()
        if summary is None:
            raise InputError(f"{source} was cut short: 'mjspace recover' writes what can be saved")
        writer.start(reader.get_header().profile, reader.get_header().library)
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        for attached in reader.iter_attachments():
            writer.add_attachment(
                attached.create_time,
                attached.log_time,
                attached.name,
                attached.media_type,
                attached.data,
            )
        channels = {}
        for channel in summary.channels.values():
            if channel.topic in kinds:
                raise InputError(f"{source} has {channel.topic} already: convert the first log")
            schema = summary.schemas[channel.schema_id]
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[channel.topic] = writer.register_channel(
                channel.topic, channel.message_encoding, number, channel.metadata
            )
        for topic, kind in kinds.items():
            described = kind.DESCRIPTOR
            number = writer.register_schema(
                described.full_name, "protobuf", descriptor_of(described.file)
            )
            channels[topic] = writer.register_channel(topic, "protobuf", number)
        logged = (
            (message.log_time, channel.topic, message.sequence, message.data)
            for _, channel, message in reader.iter_messages()
        )
        further = ((stamp, topic, 0, data) for topic, stamp, data in added)
        for stamp, topic, sequence, data in heapq.merge(logged, further, key=lambda each: each[0]):
            writer.add_message(channels[topic], stamp, data, stamp, sequence)
    writer.finish()  # type: ignore[no-untyped-call]
