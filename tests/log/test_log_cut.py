"""A log that ends too early, wherever that is, gives back everything before that."""

import errno
import os
import re
import signal
import subprocess
import sys
import textwrap
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from full_disk import room_for
from hypothesis import example, given, settings
from hypothesis import strategies as st
from log_samples import BLOCKS, METADATA, create, fly, rows, write_block
from mcap.reader import make_reader
from mcap.writer import Writer

from mjspace.log.reader import Log
from mjspace.log.schema import channels


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly(tmp_path_factory.mktemp("log") / "flight.mcap")


def assert_prefix(path: Path, count: int) -> None:
    """Assert that the log holds exactly the first ``count`` periods, and is known to be cut."""
    log = Log(path)
    assert not log.complete
    assert log.metadata == METADATA
    assert len(log) == count
    _, values = rows(0, count)
    for topic in log.topics:
        read = log.read(topic)
        for field, column in values[topic].items():
            np.testing.assert_array_equal(read[field], column)
    assert len(log.events()) == sum(np.cumsum(BLOCKS) <= count)


@settings(max_examples=80, deadline=None)
@given(cut=st.floats(0, 1, exclude_max=True))
@example(cut=0.0)
def test_a_log_cut_anywhere_is_read_up_to_the_last_whole_chunk(cut: float, whole: Path) -> None:
    content = whole.read_bytes()
    size = int(cut * len(content))
    with whole.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    ends = [c.chunk_start_offset + c.chunk_length for c in summary.chunk_indexes]
    note = summary.metadata_indexes[0]
    path = whole.with_name("cut.mcap")
    path.write_bytes(content[:size])
    if size < note.offset + note.length:
        with pytest.raises(
            ValueError, match=r"cut.mcap is (not an MCAP file|an MCAP file, but not a log)"
        ):
            Log(path)
    else:
        assert_prefix(
            path, int(np.sum([n for n, end in zip(BLOCKS, ends, strict=True) if end <= size]))
        )


def test_a_chunk_is_read_from_its_last_byte_on_and_without_its_indexes(whole: Path) -> None:
    with whole.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    content, path = whole.read_bytes(), whole.with_name("edge.mcap")
    for chunk, count in ((2, BLOCKS[0] + BLOCKS[1]), (1, BLOCKS[0])):
        place = summary.chunk_indexes[chunk]
        end = place.chunk_start_offset + place.chunk_length
        indexes = sorted(place.message_index_offsets.values())
        for cut in (end, end + 1, indexes[1], indexes[-1] + 3, end + place.message_index_length):
            path.write_bytes(content[:cut])
            assert_prefix(path, count + BLOCKS[chunk])
        path.write_bytes(content[: end - 1])
        assert_prefix(path, count)


def test_a_log_cut_before_its_first_chunk_holds_no_period(whole: Path) -> None:
    with whole.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    path = whole.with_name("empty.mcap")
    path.write_bytes(whole.read_bytes()[: summary.chunk_indexes[0].chunk_start_offset])
    assert_prefix(path, 0)


def test_a_log_is_not_complete_whose_records_do_not_lead_to_its_end(whole: Path) -> None:
    with whole.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    content = bytearray(whole.read_bytes())
    third = summary.chunk_indexes[2].chunk_start_offset
    content[third + 8] = 0xFF  # the length, then longer than the file
    path = whole.with_name("lost.mcap")
    path.write_bytes(content)
    assert_prefix(path, BLOCKS[0] + BLOCKS[1])


def test_a_record_that_cannot_be_read_is_damage_and_named_as_that(whole: Path) -> None:
    content = whole.read_bytes()
    encoding = content.index(b"ros2msg")
    path = whole.with_name("torn.mcap")
    path.write_bytes(content[:encoding] + b"\xff" + content[encoding + 1 :])  # no UTF-8
    with pytest.raises(
        ValueError, match=r"torn.mcap is damaged: the schema record at byte \d+ cannot be read"
    ):
        Log(path)


def test_zeros_that_a_power_cut_left_behind_are_no_records(whole: Path) -> None:
    with whole.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    path = whole.with_name("zeros.mcap")
    cut = summary.chunk_indexes[2].chunk_start_offset
    path.write_bytes(whole.read_bytes()[:cut] + bytes(4096))
    assert_prefix(path, sum(BLOCKS[:2]))


def test_a_log_is_read_while_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    with create(path) as log:
        for i, count in enumerate(BLOCKS):
            write_block(log, sum(BLOCKS[:i]), count)
            log.flush()
            assert_prefix(path, sum(BLOCKS[: i + 1]))
    assert Log(path).complete


def test_a_killed_flight_leaves_all_but_the_chunks_in_flight(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    code = f"""
        import sys
        from pathlib import Path
        sys.path.insert(0, {str(Path(__file__).parents[1])!r})
        from log_samples import create, write_block
        log = create(Path({str(path)!r}))
        for i in range(10**9):
            write_block(log, 50 * i, 50)
            print(i + 1, flush=True)
    """
    with subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)], stdout=subprocess.PIPE, text=True
    ) as flight:
        assert flight.stdout is not None
        written = 0
        while written < 20:
            written = int(flight.stdout.readline())
        flight.send_signal(signal.SIGKILL)
        # What it still said before it died counts too; its last line may be torn.
        said = flight.stdout.read().split("\n")[:-1]
    written = int(said[-1]) if said else written
    log = Log(path)
    assert not log.complete
    assert len(log) >= 50 * (written - 2)
    time, values = rows(0, len(log))
    read = log.read("/state")
    np.testing.assert_array_equal(read["time"], time)
    np.testing.assert_array_equal(read["physics"], values["/state"]["physics"])


def test_a_disk_that_fills_up_is_an_error_and_what_fitted_is_kept(
    tmp_path: Path, whole: Path
) -> None:
    path = tmp_path / "flight.mcap"
    with whole.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    second = summary.chunk_indexes[1]
    torn = second.chunk_start_offset + second.chunk_length // 2
    with room_for(torn):
        log = create(path)
        with pytest.raises(OSError, match="File too large") as caught:  # noqa: PT012
            # The torn chunk is the last one, so that nothing after it can betray it.
            for i, count in enumerate(BLOCKS[:2]):
                write_block(log, sum(BLOCKS[:i]), count)
            log.flush()
        assert caught.value.errno == errno.EFBIG
    # There would be room again; but what follows a torn chunk could never be found.
    with pytest.raises(OSError, match="File too large"):
        log.close()
    log.close()
    assert path.stat().st_size == torn
    assert_prefix(path, BLOCKS[0])


def test_an_error_on_its_way_out_is_not_hidden_by_the_full_disk(tmp_path: Path) -> None:
    fly_and(max, tmp_path / "whole.mcap")
    with room_for((tmp_path / "whole.mcap").stat().st_size - 1):
        with pytest.raises(ZeroDivisionError):
            fly_and(divmod, tmp_path / "one.mcap")
        with pytest.raises(OSError, match="File too large"):
            fly_and(max, tmp_path / "other.mcap")


def fly_and(function: Callable[[int, int], object], path: Path) -> None:
    with create(path) as log:
        write_block(log, 0, 10)
        function(1, 0)


@pytest.mark.skipif(not os.path.exists("/proc/self/fd"), reason="Linux only")
def test_no_space_at_all_is_said_at_once_and_nothing_stays(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    with room_for(100), pytest.raises(OSError, match="File too large"):
        create(path)
    assert not path.exists()
    assert not [name for name in opened() if name.startswith(str(path))]


def test_nothing_of_a_closed_log_stays_open(tmp_path: Path) -> None:
    path = fly(tmp_path / "flight.mcap")
    assert str(path) not in opened()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("log")]


def opened() -> list[str]:
    """Return what this process has open; not what was closed since the folder was listed."""
    files = [Path("/proc/self/fd") / name for name in os.listdir("/proc/self/fd")]
    return [str(file.readlink()) for file in files if file.is_symlink()]


def test_a_damaged_chunk_is_named_and_the_others_are_read(whole: Path) -> None:
    with whole.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    content = bytearray(whole.read_bytes())
    second = summary.chunk_indexes[1]
    content[second.chunk_start_offset + second.chunk_length // 2] ^= 0x10
    path = whole.with_name("damaged.mcap")
    path.write_bytes(content)
    log = Log(path)
    where = re.escape(f"{path}: the chunk at byte {second.chunk_start_offset + 9} cannot be read")
    with pytest.raises(ValueError, match=where):
        log.read("/truth")
    assert len(log.read("/truth", end=0.006)["time"]) == BLOCKS[0]


def test_a_damaged_chunk_does_not_matter_to_what_is_in_others(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    with create(path) as log:
        write_block(log, 0, 10)
        log.write(*rows(10, 10))
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    content = bytearray(path.read_bytes())
    second = summary.chunk_indexes[1]
    content[second.chunk_start_offset + second.chunk_length // 2] ^= 0x10
    path.write_bytes(content)
    assert [event.message for event in Log(path).events()] == ["period 5"]


def test_a_damaged_index_is_named(whole: Path) -> None:
    with whole.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    first = summary.chunk_indexes[0]
    content = bytearray(whole.read_bytes())
    for position in first.message_index_offsets.values():
        content[position + 9 + 6 + 8 + 7] ^= 0xFF  # of the first offset, its highest byte
    path = whole.with_name("damaged.mcap")
    path.write_bytes(content)
    where = f"the chunk at byte {first.chunk_start_offset + 9} cannot be read: its index is damaged"
    for read in (Log(path).altered, lambda: Log(path).read("/truth")):
        with pytest.raises(ValueError, match=where):
            read()


def test_messages_that_another_program_encoded_anew_are_not_misread(tmp_path: Path) -> None:
    path = tmp_path / "anew.mcap"
    fields = {"energy": (), "rate": (3,)}
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_metadata("mjspace", {})
        (schema, *_), (channel, *_) = channels({"/truth": fields}, {})
        writer.register_schema(schema.name, schema.encoding, schema.data)
        writer.register_channel("/truth", "protobuf", 1, channel.metadata)
        # As most encoders do, without the energy, which is zero: tag 2, 24 bytes, the rate.
        for k in range(2):
            writer.add_message(1, k, b"\x12\x18" + np.arange(3.0).tobytes(), k)
        writer.finish()
    with pytest.raises(ValueError, match="/truth is not laid out as mjspace writes it"):
        Log(path).read("/truth")


def test_a_file_of_something_else_is_refused_in_one_line(tmp_path: Path) -> None:
    text = tmp_path / "notes.txt"
    text.write_text("no log")
    with pytest.raises(ValueError, match=r"notes\.txt is not an MCAP file$"):
        Log(text)
    foreign = tmp_path / "foreign.mcap"
    with foreign.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/truth", "json", 0)
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    with pytest.raises(ValueError, match=r"foreign\.mcap is an MCAP .* not a log of mjspace"):
        Log(foreign)
    with pytest.raises(FileNotFoundError):
        Log(tmp_path / "none.mcap")
