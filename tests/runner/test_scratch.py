"""Temporary folders: empty, removed, and those of processes that were killed by the next one."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest

from mjspace.runner import scratch


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_a_folder_is_this_users_alone_and_removed(place: Path) -> None:
    with scratch.folder() as made, scratch.folder() as other:
        assert made != other
        assert made.stat().st_mode & 0o777 == 0o700
        (made / "law.py").touch()
        assert sorted(place.iterdir()) == sorted([made, other])
    assert not list(place.iterdir())


KILLED = """
import os, signal, tempfile
from mjspace.runner import scratch
tempfile.tempdir = {place!r}
with scratch.folder() as made:
    (made / "law.py").touch()
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_kill_left_is_removed_by_the_next(place: Path) -> None:
    subprocess.run([sys.executable, "-c", KILLED.format(place=str(place))], check=False)
    (left,) = place.iterdir()
    assert (left / "law.py").exists()
    with scratch.folder() as made:
        assert list(place.iterdir()) == [made]


def test_what_is_not_one_of_them_stays(place: Path) -> None:
    kept = place / "elsewhere" / "kept"
    kept.mkdir(parents=True)
    (place / "mjspace-unpacked-results-of-mine").mkdir()
    (place / "mjspace-unpacked-12345678").symlink_to(kept)
    (place / "mjspace-unpacked-87654321").touch()
    before = sorted(place.iterdir())
    with scratch.folder():
        pass
    assert sorted(place.iterdir()) == before
    assert kept.exists()


@pytest.mark.skipif(os.getuid() != 0, reason="a folder can be given to another user by root alone")
def test_another_users_stays(place: Path) -> None:
    theirs = place / "mjspace-unpacked-abcdefgh"
    theirs.mkdir()
    os.chown(theirs, 12345, 12345)
    with scratch.folder():
        pass
    assert theirs.exists()


def test_one_that_was_taken_for_left_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    taken = []

    def lost(descriptor: int) -> bool:
        taken.append(descriptor)
        return len(taken) > 1

    monkeypatch.setattr("mjspace.log.lock.lock", lost)
    with scratch.folder() as made:
        assert made.exists()
    assert len(taken) == 2


def test_one_that_is_removed_before_it_is_opened_is_made_again(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made_by, removed = tempfile.mkdtemp, list[str]()

    def lost(**options: Any) -> str:
        made = made_by(**options)
        if not removed:  # another process cleans up at that moment
            removed.append(made)
            Path(made).rmdir()
        return made

    monkeypatch.setattr(tempfile, "mkdtemp", lost)
    with scratch.folder() as made:
        assert list(place.iterdir()) == [made] != [Path(removed[0])]
