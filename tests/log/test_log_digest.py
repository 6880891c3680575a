"""A log that was changed since its flight is recognised by the digests that it holds."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from log_samples import BLOCKS, METADATA, TOPICS, create, fly, rewritten, write_block
from mcap.reader import make_reader
from mcap.records import Metadata

from mjspace.log.chunk import record_bytes
from mjspace.log.reader import Log


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly(tmp_path_factory.mktemp("log") / "flight.mcap")


def digests_of(path: Path) -> dict[str, str]:
    with path.open("rb") as file:
        notes = {note.name: note.metadata for note in make_reader(file).iter_metadata()}
    return notes["mjspace.sha256"]


def test_they_are_over_time_and_content_of_every_message(flown: Path) -> None:
    hashes = {topic: hashlib.sha256() for topic in TOPICS}
    with flown.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages(list(TOPICS)):
            times = np.array([message.log_time, message.publish_time], "<u8").tobytes()
            hashes[channel.topic].update(times + message.data)
    assert digests_of(flown) == {topic: hashed.hexdigest() for topic, hashed in hashes.items()}


def test_they_do_not_depend_on_the_blocks(flown: Path, tmp_path: Path) -> None:
    with create(tmp_path / "one.mcap") as log:
        write_block(log, 0, sum(BLOCKS))
    assert digests_of(tmp_path / "one.mcap") == digests_of(flown)


def test_a_log_is_as_it_was_written_also_after_another_tool_wrote_it(
    flown: Path, tmp_path: Path
) -> None:
    assert Log(flown).altered() == []
    assert Log(rewritten(flown, tmp_path / "again.mcap")).altered() == []


def test_what_another_tool_notes_is_no_digest_and_no_metadata_of_ours(
    flown: Path, tmp_path: Path
) -> None:
    path = tmp_path / "noted.mcap"
    note = record_bytes(Metadata("robotics.tags", {"/truth": "good"}))
    whole = flown.read_bytes()
    path.write_bytes(whole[:8] + note + whole[8:])
    assert Log(path).metadata == METADATA
    assert Log(path).altered() == []


@pytest.mark.parametrize("topic", ["/state", "/truth"])
@pytest.mark.parametrize("number", [0, 57, sum(BLOCKS) - 1])
def test_one_changed_bit_is_noticed(flown: Path, tmp_path: Path, topic: str, number: int) -> None:
    def flip(at: str, k: int, data: bytes) -> bytes:
        return data[:-1] + bytes([data[-1] ^ 1]) if (at, k) == (topic, number) else data

    assert Log(rewritten(flown, tmp_path / "bit.mcap", flip)).altered() == [topic]


def test_a_missing_row_is_noticed(tmp_path: Path) -> None:
    with create(tmp_path / "short.mcap") as log:
        write_block(log, 0, 10)
    with create(tmp_path / "long.mcap") as log:
        write_block(log, 0, 11)
    assert digests_of(tmp_path / "short.mcap")["/law"] != digests_of(tmp_path / "long.mcap")["/law"]


def test_of_a_log_without_them_nothing_is_known(flown: Path, tmp_path: Path) -> None:
    assert Log(rewritten(flown, tmp_path / "old.mcap", digests=False)).altered() is None
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(flown.read_bytes()[:-200])
    assert not Log(cut).complete
    assert Log(cut).altered() is None
