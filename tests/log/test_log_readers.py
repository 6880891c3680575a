"""Readers that know nothing of mjspace find everything in a log: ``mcap``, protobuf and Rerun."""

import re
import struct
import subprocess
import sys
import zlib
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from log_samples import (
    ATTACHMENTS,
    BLOCKS,
    METADATA,
    SCENE,
    TOPICS,
    UNITS,
    create,
    fly,
    rewritten,
    rows,
    write_block,
)
from mcap.opcode import Opcode
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Chunk, DataEnd, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer
from mcap_protobuf.decoder import DecoderFactory

from mjspace.log.reader import Log
from mjspace.log.writer import LogWriter

RERUN = Path(sys.executable).with_name("rerun")


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly(tmp_path_factory.mktemp("log") / "flight.mcap")


@pytest.fixture(scope="module")
def messages(flown: Path) -> dict[str, list[Any]]:
    found = defaultdict(list)
    with flown.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        topics = [*TOPICS, "/tf", "/scene", "/events"]
        for _, channel, message, decoded in reader.iter_decoded_messages(topics):
            found[channel.topic].append((message, decoded))
    return found


@pytest.mark.parametrize("topic", TOPICS)
def test_protobuf_decodes_the_numbers_that_were_written(
    topic: str, messages: dict[str, list[Any]]
) -> None:
    time, values = rows(0, sum(BLOCKS))
    assert len(messages[topic]) == sum(BLOCKS)
    for k, (message, decoded) in enumerate(messages[topic]):
        assert message.sequence == k
        assert message.log_time == message.publish_time == round(time[k] * 1e9)
        for field, column in values[topic].items():
            assert np.ravel(getattr(decoded, field)).tobytes() == column[k].tobytes()


def test_a_number_is_a_plot_and_not_an_array_of_one(messages: dict[str, list[Any]]) -> None:
    assert isinstance(messages["/truth"][0][1].attitude_error, float)


def test_frames_are_where_the_bodies_were(messages: dict[str, list[Any]]) -> None:
    for message, decoded in messages["/tf"]:
        bus, wheel = decoded.transforms
        t = message.log_time / 1e9
        for frame, name, factor in ((bus, "bus", 1.0), (wheel, "wheel_0", 2.0)):
            assert (frame.parent_frame_id, frame.child_frame_id) == ("world", name)
            assert frame.timestamp.ToNanoseconds() == message.log_time
            place = frame.translation
            assert (place.x, place.y, place.z) == (factor * t, -factor * t, 0.0)
        assert message.sequence == 0  # the frames are not counted, as the periods are
        turn = (np.cos(t), *(np.sin(t) * np.array([0.36, 0.48, 0.8])))
        for frame, sign in ((bus, 1.0), (wheel, -1.0)):
            found = (frame.rotation.w, frame.rotation.x, frame.rotation.y, frame.rotation.z)
            assert found == tuple(sign * number for number in turn)
    stamps = [message.log_time for message, _ in messages["/tf"]]
    assert len(stamps) == sum(-(-count // 10) for count in BLOCKS)


def test_the_scene_and_the_events_are_foxgloves(messages: dict[str, list[Any]]) -> None:
    ((message, scene),) = messages["/scene"]
    assert (message.log_time, [entity.id for entity in scene.entities]) == (0, ["bus"])
    assert message.sequence == 0  # not counted, as the periods are
    events = [decoded for _, decoded in messages["/events"]]
    assert [event.level for event in events] == [3] * len(BLOCKS)  # WARNING
    assert events[0].message == "period 3"
    assert events[0].timestamp.ToNanoseconds() == 3_000_000


def test_the_robot_description_is_a_ros_string(flown: Path) -> None:
    with flown.open("rb") as file:
        ((schema, channel, message),) = make_reader(file).iter_messages("/robot_description")
    assert schema is not None
    assert (schema.name, schema.encoding, schema.data) == (
        "std_msgs/msg/String",
        "ros2msg",
        b"string data",
    )
    assert channel.message_encoding == "cdr"
    # XCDR1: 00 01 is little endian; a string's length counts its final zero.
    assert message.data[:4] == b"\0\1\0\0"
    assert int.from_bytes(message.data[4:8], "little") == len(message.data) - 8
    assert message.data[8:] == SCENE.urdf.encode() + b"\0"


def test_the_summary_agrees_with_the_data(flown: Path) -> None:
    with flown.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        ours, digests = reader.iter_metadata()
        assert (ours.name, ours.metadata) == ("mjspace", METADATA)
        assert (digests.name, list(digests.metadata)) == ("mjspace.sha256", list(TOPICS))
        assert {a.name: (a.media_type, a.data) for a in reader.iter_attachments()} == ATTACHMENTS
        assert summary is not None
        assert summary.statistics is not None
        counts: Counter[int] = Counter()
        # The slow way through the whole file checks every checksum and every length on its way.
        file.seek(0)
        for _, channel, _ in NonSeekingReader(file, validate_crcs=True).iter_messages():
            counts[channel.id] += 1
    statistics = summary.statistics
    assert statistics.channel_message_counts == counts
    assert statistics.message_count == sum(counts.values())
    assert statistics.message_start_time == 0
    assert statistics.message_end_time == (sum(BLOCKS) - 1) * 1_000_000
    assert statistics.metadata_count == len(summary.metadata_indexes) == 2
    assert statistics.attachment_count == len(summary.attachment_indexes) == len(ATTACHMENTS)
    assert statistics.channel_count == statistics.schema_count == len(counts)
    assert statistics.chunk_count == len(summary.chunk_indexes) == len(BLOCKS)
    channels = {channel.topic: channel for channel in summary.channels.values()}
    assert channels["/state"].metadata["shape.law_p"] == "2,3"
    assert channels["/truth"].metadata["unit.attitude_error"] == "rad"


def test_the_summary_says_when_a_flight_from_the_middle_began(tmp_path: Path) -> None:
    with create(tmp_path / "flight.mcap") as log:
        write_block(log, 5000, 10)
    with (tmp_path / "flight.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_start_time == 5_000_000_000
    with (tmp_path / "flight.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        ((*_, message, decoded),) = reader.iter_decoded_messages(["/tf"])
    # Whole seconds and the rest are two numbers in a frame.
    assert {frame.timestamp.ToNanoseconds() for frame in decoded.transforms} == {message.log_time}


def test_the_summary_of_a_flight_of_no_period_has_no_span(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    create(path).close()
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    statistics = summary.statistics
    assert (statistics.message_start_time, statistics.message_end_time) == (0, 0)
    assert (statistics.message_count, statistics.chunk_count) == (0, 0)
    assert Log(path).complete
    assert (len(Log(path)), Log(path).events()) == (0, [])


@pytest.mark.parametrize("attachments", [ATTACHMENTS, {}])
def test_the_summarys_offsets_divide_it_by_kinds_of_record(
    attachments: dict[str, tuple[str, bytes]], tmp_path: Path
) -> None:
    path = tmp_path / "flight.mcap"
    with LogWriter(path, TOPICS, METADATA, attachments, SCENE, UNITS) as log:
        write_block(log, 0, 10)
    content = path.read_bytes()
    start, offsets_start = struct.unpack("<QQ", content[-28:-12])
    place, kinds, at = start, [], offsets_start
    while content[at] == Opcode.SUMMARY_OFFSET:
        opcode, group_start, length = struct.unpack("<BQQ", content[at + 9 : at + 26])
        assert group_start == place
        kinds.append(opcode)
        place, at = place + length, at + 26
        inner = group_start
        while inner < place:  # no record of another kind, and none beyond the group's end
            assert content[inner] == opcode
            inner += 9 + int.from_bytes(content[inner + 1 : inner + 9], "little")
        assert inner == place > group_start
    assert (place, content[at]) == (offsets_start, Opcode.FOOTER)
    assert len(set(kinds)) == len(kinds) == (6 if attachments else 5)


def test_the_summary_says_where_each_attachment_is_and_when_is_no_wall_clock(flown: Path) -> None:
    content = flown.read_bytes()
    with flown.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        attached = {a.name: a for a in reader.iter_attachments()}
    assert summary is not None
    for index in summary.attachment_indexes:
        record = attached[index.name]
        assert content[index.offset] == Opcode.ATTACHMENT
        assert int.from_bytes(content[index.offset + 1 :][:8], "little") == index.length - 9
        assert (index.data_size, index.media_type) == (len(record.data), record.media_type)
        # A log is the same whenever it is flown.
        assert {index.log_time, index.create_time, record.log_time, record.create_time} == {0}


def test_what_follows_the_data_has_no_checksum_that_could_be_wrong(flown: Path) -> None:
    with flown.open("rb") as file:
        records = list(StreamReader(file, emit_chunks=True).records)
    (end,) = [record for record in records if isinstance(record, DataEnd)]
    assert end.data_section_crc == 0  # the specification: not computed


def test_the_summary_agrees_with_each_chunk(flown: Path) -> None:
    with flown.open("rb") as file:
        summary = make_reader(file).get_summary()
        file.seek(0)
        chunks = [r for r in StreamReader(file, emit_chunks=True).records if isinstance(r, Chunk)]
    assert summary is not None
    content = flown.read_bytes()
    for chunk, index in zip(chunks, summary.chunk_indexes, strict=True):
        assert content[index.chunk_start_offset] == Opcode.CHUNK
        after = index.chunk_start_offset + index.chunk_length
        assert content[after] == Opcode.MESSAGE_INDEX
        end = after + index.message_index_length
        while after < end:
            assert content[after] == Opcode.MESSAGE_INDEX
            after += 9 + int.from_bytes(content[after + 1 : after + 9], "little")
        assert after == end
        assert content[end] in (Opcode.CHUNK, Opcode.METADATA)
        assert index.compressed_size == len(chunk.data)
        assert index.uncompressed_size == chunk.uncompressed_size
        times = [m.log_time for m in breakup_chunk(chunk, True) if isinstance(m, Message)]
        span = min(times), max(times)
        assert (index.message_start_time, index.message_end_time) == span
        assert (chunk.message_start_time, chunk.message_end_time) == span


def test_the_summarys_checksum_covers_it_and_the_footer(flown: Path) -> None:
    # The specification: from the summary's first byte to the last before the checksum itself, which
    # the closing magic follows.
    content = flown.read_bytes()
    checksum, magic = content[-12:-8], content[-8:]
    start = int.from_bytes(content[-28:-20], "little")
    assert magic == content[:8]
    assert int.from_bytes(checksum, "little") == zlib.crc32(content[start:-12])


def test_the_summary_says_where_each_message_index_is(flown: Path) -> None:
    with flown.open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        for chunk in summary.chunk_indexes:
            end = chunk.chunk_start_offset + chunk.chunk_length + chunk.message_index_length
            for channel, place in sorted(chunk.message_index_offsets.items(), reverse=True):
                file.seek(place)
                opcode, length, found = struct.unpack("<BQH", file.read(11))
                assert (opcode, found) == (Opcode.MESSAGE_INDEX, channel)
                assert place + 9 + length <= end


def test_all_that_explains_the_data_comes_before_it(flown: Path) -> None:
    with flown.open("rb") as file:
        order = [type(r).__name__ for r in StreamReader(file, emit_chunks=True).records]
    first = order.index("Chunk")
    assert set(order[:first]) == {"Header", "Metadata", "Schema", "Channel", "Attachment"}
    assert not {"Schema", "Channel", "Attachment"} & set(order[first : order.index("DataEnd")])


def test_the_message_indexes_lead_to_the_messages(flown: Path) -> None:
    # Reading backwards in time goes by the indexes alone.
    with flown.open("rb") as file:
        reader = make_reader(file)
        found = [message.sequence for *_, message in reader.iter_messages("/truth", reverse=True)]
    assert found == list(range(sum(BLOCKS)))[::-1]


def test_the_examples_on_the_page_run(
    flown: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = Path(__file__).parents[2] / "docs" / "log.md"
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)
    ours, _, plain = blocks  # the second is for a notebook: tests/test_docs.py runs it
    monkeypatch.chdir(flown.parent)
    exec(ours, {})
    assert f"{sum(BLOCKS)} 0.0 0.167 True" in capsys.readouterr().out
    exec(plain, {})
    assert len(capsys.readouterr().out.splitlines()) == sum(BLOCKS)


def test_a_copy_by_another_writer_reads_the_same(flown: Path, tmp_path: Path) -> None:
    # Its chunks end elsewhere, hold schemas and channels, and the channels' numbers are others.
    path = tmp_path / "copy.mcap"
    with flown.open("rb") as file, path.open("wb") as copy:
        writer = Writer(copy, chunk_size=5000)
        writer.start()
        writer.add_metadata("mjspace", METADATA)
        numbers: dict[str, int] = {}
        for schema, channel, message in make_reader(file).iter_messages(reverse=False):
            assert schema is not None
            if channel.topic not in numbers:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                numbers[channel.topic] = writer.register_channel(
                    channel.topic, channel.message_encoding, number, channel.metadata
                )
            writer.add_message(
                numbers[channel.topic],
                message.log_time,
                message.data,
                message.publish_time,
                message.sequence,
            )
        writer.finish()
    ours, theirs = Log(flown), Log(path)
    assert theirs.complete
    assert theirs.topics == ours.topics
    assert theirs.events() == ours.events()
    assert len(theirs) == len(ours)
    for topic in ours.topics:
        wanted = ours.read(topic)
        assert {name: column.tobytes() for name, column in theirs.read(topic).items()} == {
            name: column.tobytes() for name, column in wanted.items()
        }


def test_a_copy_in_one_chunk_is_read_also_when_its_summary_is_cut_off(
    flown: Path, tmp_path: Path
) -> None:
    # Its schemas and channels are in the chunk too, among the messages that are looked for there.
    path = rewritten(flown, tmp_path / "copy.mcap")
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    (chunk,) = summary.chunk_indexes
    whole = Log(path).read("/state")
    assert len(whole["time"]) == sum(BLOCKS)
    content = path.read_bytes()
    declarations = content[int.from_bytes(content[-28:-20], "little") : -8]
    end = chunk.chunk_start_offset + chunk.chunk_length
    path.write_bytes(
        content[: chunk.chunk_start_offset]
        + declarations_of(declarations)
        + content[chunk.chunk_start_offset : end]
    )
    cut = Log(path)
    assert not cut.complete
    assert {name: c.tobytes() for name, c in cut.read("/state").items()} == {
        name: c.tobytes() for name, c in whole.items()
    }


def declarations_of(summary: bytes) -> bytes:
    """Return the Schema and Channel records of a summary."""
    found, at = b"", 0
    while at < len(summary):
        size = 9 + int.from_bytes(summary[at + 1 : at + 9], "little")
        if summary[at] in (Opcode.SCHEMA, Opcode.CHANNEL):
            found += summary[at : at + size]
        at += size
    return found


def test_an_uncompressed_copy_is_read_and_another_compression_named(
    flown: Path, tmp_path: Path
) -> None:
    plain = rewritten(flown, tmp_path / "plain.mcap", compression=CompressionType.NONE)
    assert Log(plain).altered() == []
    packed = rewritten(flown, tmp_path / "packed.mcap", compression=CompressionType.LZ4)
    with pytest.raises(ValueError, match=r"packed.mcap: .* compression 'lz4': write the log anew"):
        Log(packed).read("/truth")


@pytest.mark.skipif(not RERUN.exists(), reason="rerun-sdk is not installed")
def test_rerun_finds_nothing_wrong(flown: Path) -> None:
    check = subprocess.run(
        [RERUN, "mcap", "check", "--full", flown], capture_output=True, text=True, check=True
    )
    # It returns 0 also when it has found problems: its table says so.
    table = [line.split() for line in check.stdout.splitlines() if " /" in line]
    assert {row[3]: row[0] for row in table} == dict.fromkeys(
        [*TOPICS, "/tf", "/scene", "/events", "/robot_description"], "ok"
    )
