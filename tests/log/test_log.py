"""A log gives back what was written, bit for bit, in memory that does not grow with the flight."""

import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from log_samples import ATTACHMENTS, BLOCKS, METADATA, create, fly, rows, write_block
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from mjspace.contract import Array
from mjspace.log import reader
from mjspace.log.content import Content, read_content
from mjspace.log.encoding import Fields, doubles, varint5
from mjspace.log.reader import Log
from mjspace.log.schema import PERIODIC, Scene
from mjspace.log.writer import LogWriter


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly(tmp_path_factory.mktemp("log") / "flight.mcap")


SHAPES = st.lists(st.integers(0, 3), max_size=3).map(tuple)
NAMES = st.from_regex(r"[a-z][a-z0-9_]{0,8}", fullmatch=True).filter(lambda name: name != "time")
FIELDS = st.dictionaries(NAMES, SHAPES, max_size=4)


SPECIAL = np.array([np.nan, -np.nan, np.inf, -0.0, 5e-324, 1.7e308]).view(np.uint64)
SIGNALLING_NAN = np.uint64(0x7FF0_0000_0000_0001)


def any_bits(rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
    bits = rng.integers(2**64, size=shape, dtype=np.uint64)
    special = rng.choice([*SPECIAL, SIGNALLING_NAN], size=shape)
    return np.asarray(np.where(rng.random(shape) < 0.3, special, bits)).view(np.float64)


@settings(max_examples=40, deadline=None)
@given(
    topics=st.dictionaries(st.sampled_from(sorted(PERIODIC)), FIELDS, min_size=1),
    counts=st.lists(st.integers(1, 5), min_size=1, max_size=4),
    seed=st.integers(0, 2**32 - 1),
)
def test_every_bit_comes_back(
    topics: dict[str, Fields],
    counts: list[int],
    seed: int,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.integers(1, 10**12, size=sum(counts))) / 1e9
    written = {
        topic: {field: any_bits(rng, (len(time), *shape)) for field, shape in fields.items()}
        for topic, fields in topics.items()
    }
    path = tmp_path_factory.mktemp("log") / "flight.mcap"
    with LogWriter(path, topics, {}, {}, Scene((), b"", ""), {}) as log:
        for end, count in zip(np.cumsum(counts), counts, strict=True):
            part = slice(end - count, end)
            values = {t: {f: v[part] for f, v in fields.items()} for t, fields in written.items()}
            log.write(time[part], values)
    read = Log(path)
    assert (read.complete, len(read), read.start, read.end) == (True, len(time), time[0], time[-1])
    assert read.topics == topics
    for topic, fields in written.items():
        columns = read.read(topic)
        assert columns.pop("time").tobytes() == time.tobytes()
        assert columns.keys() == fields.keys()
        for field, column in fields.items():
            assert columns[field].shape == column.shape
            assert columns[field].tobytes() == column.tobytes()


def test_what_describes_the_flight_comes_back(flown: Path) -> None:
    log = Log(flown)
    assert log.metadata == METADATA
    assert {name: log.attachment(name) for name in log.attachments} == {
        name: content for name, (_, content) in ATTACHMENTS.items()
    }
    assert log.units == {"/state": {}, "/law": {}, "/truth": {"attitude_error": "rad"}}
    ends = np.cumsum(BLOCKS)
    middles = [end - count + count // 2 for end, count in zip(ends, BLOCKS, strict=True)]
    assert log.events() == [(k / 1000, 0, "WARNING", f"period {k}") for k in middles]


def test_a_clock_that_sums_its_steps_still_ticks_in_whole_milliseconds(tmp_path: Path) -> None:
    clock = np.cumsum(np.full(3000, 1e-3))  # as MuJoCo does; up to 2e-13 s early or late
    _, values = rows(0, 3000)
    with create(tmp_path / "flight.mcap") as log:
        log.write(clock, values)
    read = Log(tmp_path / "flight.mcap").read("/truth")
    np.testing.assert_array_equal(read["time"], np.arange(1, 3001) / 1000)


def test_a_block_too_short_for_a_frame_is_logged(tmp_path: Path) -> None:
    with create(tmp_path / "flight.mcap") as log:
        log.write_transforms(np.zeros(0), np.zeros((0, 2, 3)), np.zeros((0, 2, 4)))
        log.write(*rows(0, 3))
    assert len(Log(tmp_path / "flight.mcap").read("/truth")["time"]) == 3


def test_an_event_after_the_last_period_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    with create(path) as log:
        write_block(log, 0, 10)
        log.event(0.009, "INFO", "flushed")
        log.flush()
        assert Log(path).events()[-1] == (0.009, 0, "INFO", "flushed")
        log.event(0.009, "ERROR", "closed")
    assert Log(path).events()[-1] == (0.009, 0, "ERROR", "closed")
    assert len(Log(path)) == 10


@given(
    window=st.tuples(st.integers(-2, 170), st.integers(-2, 170)),
    every=st.sampled_from([1, 2, 7, 500]),
)
@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_a_window_holds_both_its_ends_and_every_nth_row_between(
    window: tuple[int, int], every: int, flown: Path
) -> None:
    low, high = sorted(window)
    time, values = rows(0, sum(BLOCKS))
    chosen = slice(max(low, 0), high + 1 if high >= 0 else 0, every)
    read = Log(flown).read("/state", ["law_p"], start=low / 1000, end=high / 1000, every=every)
    assert list(read) == ["time", "law_p"]
    np.testing.assert_array_equal(read["time"], time[chosen])
    np.testing.assert_array_equal(read["law_p"], values["/state"]["law_p"][chosen])


def test_topics_side_by_side_are_what_each_is_alone_and_each_chunk_is_read_once(
    flown: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = Log(flown)
    window: dict[str, Any] = {"start": 0.003, "end": 0.15, "every": 3}
    alone = {
        "/truth": log.read("/truth", ["attitude"], **window),
        "/state": log.read("/state", **window),
    }
    read: list[int] = []

    def noted(file: Any, place: Any, channels: Any) -> Content:
        read.append(place.position)
        return read_content(file, place, channels)

    monkeypatch.setattr(reader, "read_content", noted)
    together = log.read_topics({"/truth": ["attitude"], "/state": None}, **window)
    assert len(read) == len(set(read)) == len(BLOCKS)
    assert list(together) == list(alone)
    for topic, columns in alone.items():
        assert {n: c.tobytes() for n, c in together[topic].items()} == {
            n: c.tobytes() for n, c in columns.items()
        }


@pytest.mark.parametrize(
    ("asked", "found"),
    [(-1.0, 0), (0.0, 0), (0.00649, 6), (0.00651, 7), (0.1071, 107), (99.0, 167)],
)
def test_the_nearest_row_is_found_across_chunks(flown: Path, asked: float, found: int) -> None:
    row = Log(flown).nearest("/truth", asked)
    time, values = rows(0, sum(BLOCKS))
    assert row["time"] == time[found]
    np.testing.assert_array_equal(row["attitude"], values["/truth"]["attitude"][found])
    assert row["attitude_error"] == values["/truth"]["attitude_error"][found]


def test_the_nearest_row_may_stand_before_a_chunk_that_begins_with_an_earlier_event(
    tmp_path: Path,
) -> None:
    with create(tmp_path / "flight.mcap") as log:
        log.write(*rows(0, 7))
        log.event(0.0055, "INFO", "before the last row of the first chunk")
        log.write(*rows(7, 7))
    assert Log(tmp_path / "flight.mcap").nearest("/truth", 0.0062)["time"] == 0.006


def test_times_are_refused_one_by_one_and_a_window_may_be_open(tmp_path: Path) -> None:
    refused = ([0.0, -1e-3], [0.002, 0.002], [0.0, 0.002, 0.001], [0.0, np.nan])
    for number, time in enumerate(refused):
        with create(tmp_path / f"refused_{number}.mcap") as log:
            _, values = rows(0, len(time))
            with pytest.raises(ValueError, match=r"do not increase|starts at zero"):
                log.write(np.array(time), values)
    with create(tmp_path / "overlap.mcap") as log:
        log.write(*rows(0, 3))
        with pytest.raises(ValueError, match="do not increase"):
            log.write(np.array([0.001, 0.003]), rows(0, 2)[1])
    with create(tmp_path / "late.mcap") as log:
        _, values = rows(0, 2)
        log.write(np.array([0.0, 5e9]), values)  # beyond 2^62 ns, and the log's clock goes to 2^64
    read = Log(tmp_path / "late.mcap")
    assert read.read("/truth")["time"].tolist() == [0.0, 5e9]
    assert read.read("/truth", end=1.0)["time"].tolist() == [0.0]
    assert read.read("/truth", start=1.0)["time"].tolist() == [5e9]


@pytest.mark.parametrize("value", [0, 1, 127, 128, 300, 2**31, 2**35 - 1])
def test_padded_numbers_are_protobufs(value: int) -> None:
    (padded,) = varint5(np.array([value], np.uint64))
    decoded = sum((int(byte) & 0x7F) << 7 * k for k, byte in enumerate(padded))
    assert decoded == value
    assert [bool(byte & 0x80) for byte in padded] == [True] * 4 + [False]


def test_a_message_of_many_long_fields_is_what_protobuf_reads(tmp_path: Path) -> None:
    """More than 15 fields and more than 127 bytes in one: numbers of two bytes in its layout."""
    # 128 bytes is the least that takes two in a length; 40 numbers take 320.
    shapes: list[tuple[int, ...]] = [(5, 8), (2, 8), ()]
    fields = {f"f{k}": shapes[k % 3] for k in range(40)}
    values = {name: np.full((1, *shape), float(name[1:])) for name, shape in fields.items()}
    with LogWriter(tmp_path / "x.mcap", {"/truth": fields}, {}, {}, Scene((), b"", ""), {}) as log:
        log.write(np.zeros(1), {"/truth": values})
    with (tmp_path / "x.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        ((*_, decoded),) = reader.iter_decoded_messages(["/truth"])
    for name, written in values.items():
        assert np.ravel(getattr(decoded, name)).tolist() == written.ravel().tolist()


def test_a_kept_column_does_not_keep_its_chunk(flown: Path) -> None:
    for block in Log(flown).blocks("/state"):
        assert all(column.flags.owndata and column.flags.aligned for column in block.values())


def test_reading_by_chunks_never_holds_the_log(tmp_path: Path) -> None:
    def peak(count: int) -> int:
        path = tmp_path / f"{count}.mcap"
        tracemalloc.start()
        with create(path) as log:
            for i in range(count):
                write_block(log, 1000 * i, 1000)
        for block in Log(path).blocks("/state", every=10):
            del block
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    # 40 blocks of 0.4 MB; the peaks differ by what happens to be in flight, two blocks at most.
    assert peak(50) - peak(10) < 1_000_000


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time": np.array([0.0])}, "do not increase"),
        ({"time": np.array([-1e-3])}, "starts at zero"),
        ({"time": np.array([np.nan])}, "starts at zero"),
        ({"attitude": np.zeros(4)}, r"/truth.attitude: shape \(4,\), should be \(1, 4\)"),
    ],
)
def test_what_cannot_be_logged_is_refused(
    change: dict[str, Array], message: str, tmp_path: Path
) -> None:
    with create(tmp_path / "flight.mcap") as log:
        write_block(log, 0, 1)
        time, values = rows(1, 1)
        values["/truth"]["attitude"] = change.get("attitude", values["/truth"]["attitude"])
        with pytest.raises(ValueError, match=message):
            log.write(change.get("time", time), values)
    assert len(Log(tmp_path / "flight.mcap")) == 1


@pytest.mark.parametrize("field", ["time", "2nd", "größe", "with space"])
def test_a_field_needs_a_name_that_protobuf_has_room_for(field: str) -> None:
    with pytest.raises(ValueError, match=field):
        doubles({field: (3,)})


def test_an_unknown_topic_field_or_attachment_is_named_with_those_there_are(
    flown: Path, tmp_path: Path
) -> None:
    log = Log(flown)
    with pytest.raises(ValueError, match=r"no topic '/velocity' .*: have /state, /truth, /law"):
        log.read("/velocity")
    with pytest.raises(
        ValueError, match=r"no field 'error' on /truth .*: have attitude, rate, attitude_error"
    ):
        log.read("/truth", ["error"])
    with pytest.raises(ValueError, match=r"no attachment 'model' .*: have scenario.toml, empty"):
        log.attachment("model")
    with pytest.raises(ValueError, match="no topic '/thrust': have /state"):
        LogWriter(tmp_path / "x.mcap", {"/thrust": {}}, {}, {}, Scene((), b"", ""), {})
    assert not (tmp_path / "x.mcap").exists()
