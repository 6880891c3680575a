"""What can be saved of a damaged log, and that any reader reads it."""

import re
from itertools import accumulate, pairwise
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from log_samples import ATTACHMENTS, BLOCKS, METADATA, create, fly, rewritten, rows, write_block
from mcap.reader import make_reader

from mjspace.errors import InputError
from mjspace.log import salvage
from mjspace.log.content import unpacked
from mjspace.log.index import ChunkPlace, inventory
from mjspace.log.reader import Log
from mjspace.log.recover import Recovered, recover

ENDS = list(accumulate(BLOCKS))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly(tmp_path_factory.mktemp("log") / "flight.mcap")


def saved(path: Path, content: bytes) -> tuple[Recovered, Log]:
    """Return what is recovered of a log with this ``content``, which any reader reads."""
    damaged, out = path.with_name("damaged.mcap"), path.with_name("good.mcap")
    damaged.write_bytes(content)
    out.unlink(missing_ok=True)
    found = recover(damaged, out)
    with out.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        count = sum(1 for _ in reader.iter_messages())
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == count
        assert len(summary.chunk_indexes) == found.chunks
    return found, Log(out)


def assert_rows(log: Log, periods: np.ndarray) -> None:
    _, values = rows(0, sum(BLOCKS))
    for topic in log.topics:
        for field, column in values[topic].items():
            np.testing.assert_array_equal(log.read(topic)[field], column[periods])


def test_a_whole_log_is_saved_whole(whole: Path) -> None:
    found, log = saved(whole, whole.read_bytes())
    assert found.lost == ""
    assert_rows(log, np.arange(sum(BLOCKS)))
    assert log.metadata == METADATA
    assert {name: log.attachment(name) for name in log.attachments} == {
        name: data for name, (_, data) in ATTACHMENTS.items()
    }
    assert log.altered() == []
    assert [e.message for e in log.events()] == [e.message for e in Log(whole).events()]


def test_a_damaged_chunk_is_left_out_and_its_span_named(whole: Path) -> None:
    content, place = bytearray(whole.read_bytes()), inventory(whole).chunks[1]
    content[place.position + place.size // 2] ^= 0x10
    found, log = saved(whole, content)
    assert (found.chunks, found.lost_bytes) == (len(BLOCKS) - 1, place.size + 9)
    assert found.lost_spans == [((ENDS[0] - 1) / 1000, ENDS[1] / 1000)]
    assert log.metadata["recovered"] == f"lost {found.lost}"
    assert log.altered() is None
    kept = np.arange(sum(BLOCKS))
    assert_rows(log, kept[(kept < ENDS[0]) | (kept >= ENDS[1])])


def test_a_length_that_leads_astray_costs_one_chunk(whole: Path) -> None:
    content, place = bytearray(whole.read_bytes()), inventory(whole).chunks[1]
    for length in (2**40, place.size + 7, place.size - 7, 0):
        content[place.position - 8 : place.position] = length.to_bytes(8, "little")
        found, _ = saved(whole, content)
        assert found.chunks == len(BLOCKS) - 1
        assert found.lost_spans == [((ENDS[0] - 1) / 1000, ENDS[1] / 1000)]


def test_a_killed_flight_is_saved_up_to_its_last_whole_chunk(whole: Path) -> None:
    place = inventory(whole).chunks[2]
    torn = whole.read_bytes()[: place.position + place.size // 2]
    for content in (torn, torn[: place.position - 9] + bytes(4096)):
        found, log = saved(whole, content)
        assert found.lost_spans == [((ENDS[1] - 1) / 1000, np.inf)]
        assert "after 0.106 s" in found.lost
        assert_rows(log, np.arange(ENDS[1]))
    found, _ = saved(whole, whole.read_bytes()[: place.position - 9])
    assert found.lost == ""


def test_chunks_out_of_order_and_twice_are_put_in_order(whole: Path) -> None:
    content, places = whole.read_bytes(), inventory(whole).chunks
    begins = [place.position - 9 for place in places]
    a, b, c = (content[i:j] for i, j in pairwise(begins))
    moved = content[: begins[0]] + b + a + c + b + content[begins[3] :]
    found, log = saved(whole, moved)
    assert found.lost_bytes == places[1].size
    assert_rows(log, np.arange(sum(BLOCKS)))


def test_an_attachment_that_is_damaged_is_named(whole: Path) -> None:
    content = whole.read_bytes().replace(b"duration = 1.0\n", b"duration = 9.0\n")
    found, log = saved(whole, content)
    assert found.lost_attachments == ["scenario.toml"]
    assert found.attachments == ["empty"]
    assert log.attachments == ("empty",)


def test_topics_on_one_channel_are_left_out(whole: Path) -> None:
    content = bytearray(whole.read_bytes())
    truth, state = (content.index(b"\6\0\0\0" + topic) - 4 for topic in (b"/truth", b"/state"))
    content[truth : truth + 2] = content[state : state + 2]  # in the records before the chunks
    found, log = saved(whole, bytes(content))
    assert found.lost_topics == ["/state", "/truth"]
    assert "/state" not in log.topics
    assert_rows(log, np.arange(sum(BLOCKS)))


def test_a_chunk_without_events_costs_none(whole: Path) -> None:
    path = whole.with_name("quiet.mcap")
    with create(path) as quiet:
        write_block(quiet, 0, 20)
        quiet.write(*rows(20, 20))
    found, log = saved(whole, path.read_bytes())
    assert (found.lost, found.chunks) == ("", 2)
    assert [event.message for event in log.events()] == ["period 10"]


def test_events_that_cannot_be_read_are_left_out(whole: Path) -> None:
    """As where the channel of another topic has their name."""

    def change(topic: str, number: int, data: bytes) -> bytes:
        return b"\xff" + data if topic == "/events" and number == 1 else data

    foreign = rewritten(whole, whole.with_name("foreign.mcap"), change)
    with pytest.raises(InputError, match="/events is not laid out"):
        Log(foreign).events()
    found, log = saved(whole, foreign.read_bytes())
    assert found.lost_topics == ["/events"]
    assert log.metadata["recovered"] == "lost /events"
    assert log.events() == []
    assert_rows(log, np.arange(sum(BLOCKS)))


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_whatever_is_damaged_what_is_saved_is_as_it_was_written(
    whole: Path, data: st.DataObject
) -> None:
    content = bytearray(whole.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.sampled_from([1, 8, 300]))] = data.draw(
            st.binary(max_size=9)
        )
    try:
        _, log = saved(whole, bytes(content))
    except InputError:
        return
    _, values = rows(0, sum(BLOCKS))
    for topic in log.topics:
        read = log.read(topic)
        for field, column in values[topic].items():
            periods = np.rint(read["time"] * 1000).astype(int)
            np.testing.assert_array_equal(read[field], column[periods])


def test_nothing_is_overwritten_and_nothing_is_made_of_nothing(whole: Path) -> None:
    before = whole.read_bytes()
    with pytest.raises(InputError, match=r"flight.mcap exists: name a file that does not"):
        recover(whole, whole)
    assert whole.read_bytes() == before
    none, out = whole.with_name("none.mcap"), whole.with_name("out.mcap")
    for content in (b"", b"x" * 100, before[: inventory(whole).chunks[0].position]):
        none.write_bytes(content)
        with pytest.raises(InputError, match=re.escape(str(none))):
            recover(none, out)
        assert not out.exists()


def test_false_chunks_take_no_more_time_than_the_file_is_long(
    whole: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each of these claims all that follows: all of them together are n (n + 1) / 2."""
    tried = []

    def counted(file: BinaryIO, place: ChunkPlace) -> bytes:
        tried.append(place.size)
        return unpacked(file, place)

    monkeypatch.setattr(salvage, "unpacked", counted)
    monkeypatch.setattr(salvage, "MOST", 0)
    begin = whole.read_bytes()[: inventory(whole).chunks[0].position - 9]
    count = 2000
    false = b""
    for i in range(count):
        rest = (count - i) * 53
        length = rest - 10  # where no record follows
        head = b"\6" + length.to_bytes(8, "little") + bytes(28) + b"\4\0\0\0zstd"
        false += (head + max(length - 44, 0).to_bytes(8, "little")).ljust(53, b"\0")
    (path := whole.with_name("false.mcap")).write_bytes(begin + false)
    with pytest.raises(InputError, match="it has no whole chunk"):
        recover(path, whole.with_name("nothing.mcap"))
    assert len(tried) > 2
    assert sum(tried) < 10 * len(begin + false)
