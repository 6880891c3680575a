"""What a run may write over, and that no two runs write one log."""

import errno
import fcntl
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from mjspace.errors import InputError
from mjspace.log import lock
from mjspace.log.reader import Log
from mjspace.runner import run_all
from mjspace.runner.replay import replay
from mjspace.runner.run import Result, run

SHORT = ["duration=0.02", "checks=[]"]


def fly(out: Path, *, force: bool = False, seed: int = 0) -> Result:
    overrides = [*SHORT, f"seed={seed}"]
    return run("detumble-wheels", overrides=overrides, out=out, force=force)


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Lock the file as a run does that is writing it."""
    with path.open("rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def test_a_log_is_replaced_on_request_alone(tmp_path: Path) -> None:
    log = fly(tmp_path).path
    before = log.read_bytes()
    for _ in range(2):
        with pytest.raises(InputError, match=r"flight\.mcap: is there already: .* --force"):
            fly(tmp_path, seed=1)
    assert log.read_bytes() == before
    with log.open("rb") as reader:  # who reads it goes on
        fly(tmp_path, force=True, seed=1)
        assert reader.read() == before
    assert Log(log).complete
    assert Log(log).metadata["seed"] == "1"


def test_neither_a_replay_nor_all_replaces_a_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = fly(tmp_path / "one").path
    again = tmp_path / "again"
    replay(log, again)
    with pytest.raises(InputError, match="is there already"):
        replay(log, again)
    replay(log, again, force=True)
    with pytest.raises(InputError, match="holds the log that is to be flown again"):
        replay(log, tmp_path / "one", force=True)
    fly(tmp_path / "all" / "detumble-wheels")
    monkeypatch.setattr("mjspace.runner.workers.each", None)  # nothing is flown
    with pytest.raises(InputError, match="is there already"):
        run_all.fly(["pd-plus", "detumble-wheels"], SHORT, tmp_path / "all", lambda done: None)


def test_a_log_that_is_being_written_is_not_replaced(tmp_path: Path) -> None:
    log = fly(tmp_path).path
    before = log.read_bytes()
    with locked(log):
        for force in (False, True):
            with pytest.raises(InputError, match=r"flight\.mcap: another run is writing it"):
                fly(tmp_path, force=force)
        assert not lock.remove(log)
    assert log.read_bytes() == before
    fly(tmp_path, force=True)  # its run has ended, however that was


def test_a_run_that_began_meanwhile_keeps_its_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both found the folder empty: who creates the log first has it."""
    fly(tmp_path)
    before = (tmp_path / "flight.mcap").read_bytes()
    monkeypatch.setattr("mjspace.runner.run.refuse_existing", lambda path, force: None)
    with pytest.raises(InputError, match="is there already"):
        fly(tmp_path)
    assert (tmp_path / "flight.mcap").read_bytes() == before


def test_a_log_that_was_replaced_meanwhile_is_not_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "flight.mcap"
    path.write_text("old")

    def replaced(descriptor: int) -> bool:
        path.unlink()
        path.write_text("another run's")
        return True

    monkeypatch.setattr(lock, "lock", replaced)
    assert not lock.remove(path)
    assert path.read_text() == "another run's"


@pytest.mark.parametrize("there", [True, False])
def test_a_link_is_not_followed(there: bool, tmp_path: Path) -> None:
    target, link = tmp_path / "precious", tmp_path / "out" / "flight.mcap"
    if there:
        target.write_text("mine")
    link.parent.mkdir()
    link.symlink_to(target)
    with pytest.raises(InputError, match="is there already"):
        fly(link.parent)
    with pytest.raises(FileExistsError):
        lock.create(link)
    fly(link.parent, force=True)
    assert not link.is_symlink()
    assert target.exists() == there
    assert not there or target.read_text() == "mine"


def test_a_folder_in_its_place_is_refused(tmp_path: Path) -> None:
    (tmp_path / "flight.mcap").mkdir()
    with pytest.raises(InputError, match="is a folder, where the log would be"):
        fly(tmp_path, force=True)


def test_a_log_is_locked_while_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / "x"
    with lock.create(path):
        assert lock.is_locked(path)
    assert not lock.is_locked(path)
    assert not lock.is_locked(tmp_path / "none")


def test_where_there_are_no_locks_nothing_is_said_to_be_locked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def without(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", without)
    fly(tmp_path)
    assert not lock.is_locked(tmp_path / "flight.mcap")
    with pytest.raises(InputError, match="is there already"):
        fly(tmp_path)
    fly(tmp_path, force=True)


def test_the_refusal_is_one_line_and_status_2(tmp_path: Path) -> None:
    (tmp_path / "flight.mcap").touch()
    done = subprocess.run(
        [sys.executable, "-m", "mjspace", "run", "detumble-wheels", "--out", str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1
    assert "--force" in done.stderr
