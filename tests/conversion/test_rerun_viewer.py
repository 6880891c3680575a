"""Rerun's viewer with a log: what is started, until when, and what is left. None is opened."""

import os
import signal
import sys
import time
from pathlib import Path

import pytest

from mjspace.cli import app
from mjspace.conversion import rerun_viewer
from mjspace.errors import InputError
from mjspace.log.reader import Log

pytest.importorskip("rerun")

# In place of the viewer: a process that starts another, as Rerun's command does.
VIEWER = """
import pathlib, subprocess, sys
recording, told, seconds, status = sys.argv[1:]
held = pathlib.Path(recording).read_bytes()[:4]
child = subprocess.Popen([sys.executable, "-c", f"import time; time.sleep({seconds})"])
pathlib.Path(told).write_text(f"{held.decode()} {child.pid}")
child.wait()
sys.exit(int(status))
"""


@pytest.fixture
def told(tmp_path: Path) -> Path:
    return tmp_path / "told"


def viewer(monkeypatch: pytest.MonkeyPatch, told: Path, seconds: float, status: int) -> list[Path]:
    """Have one open for some seconds, in place of Rerun's; return what it is opened with."""
    opened = []

    def command(recording: Path) -> list[str]:
        opened.append(recording)
        return [sys.executable, "-c", VIEWER, *map(str, (recording, told, seconds, status))]

    monkeypatch.setattr(rerun_viewer, "command", command)
    return opened


def test_a_window_where_there_is_a_display_else_a_browser_on_this_machine_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("DISPLAY", ":0")
    window = rerun_viewer.command(Path("x.rrd"))
    assert window == [sys.executable, "-m", "rerun", "x.rrd", "--bind", "127.0.0.1"]
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert rerun_viewer.command(Path("x.rrd")) == [*window, "--web-viewer"]


def test_it_has_the_recording_until_it_is_closed(
    pictured_log: Path, told: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = viewer(monkeypatch, told, 0.0, 0)
    with pytest.raises(SystemExit) as ended:
        app(["view", str(pictured_log), "--with", "rerun"], standalone_mode=True)
    assert not ended.value.code
    assert told.read_text().startswith("RRF2 ")  # a recording's first bytes
    assert not opened[0].parent.exists()


def test_what_it_started_ends_with_it(
    pictured_log: Path, told: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = viewer(monkeypatch, told, 60.0, 0)
    rerun_viewer.show(Log(pictured_log), told.exists, lambda time: None)
    child = int(told.read_text().split()[1])
    until = time.monotonic() + 5.0
    while _runs(child) and time.monotonic() < until:
        time.sleep(0.02)
    assert not _runs(child)
    assert not opened[0].parent.exists()


def test_its_failure_is_one_line(
    pictured_log: Path, told: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    viewer(monkeypatch, told, 0.0, 3)
    with pytest.raises(OSError, match="Rerun's viewer ended with exit status 3"):
        app(["view", str(pictured_log), "--with", "rerun"], standalone_mode=True)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["LOG", "--with", "rerun", "--native"], "--native, --export, --with: give one of them"),
        (["wheel-failure", "--with", "rerun"], "--with: is for a log"),
    ],
)
def test_what_it_does_not_go_with_is_refused(arguments: list[str], line: str) -> None:
    with pytest.raises(InputError, match=line):
        app(["view", *arguments], standalone_mode=True)


def test_without_rerun_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(InputError, match=r"^--with rerun needs .*pip install 'mjspace\[rerun\]'$"):
        app(["view", "x.mcap", "--with", "rerun"], standalone_mode=True)


def _runs(process: int) -> bool:
    try:
        os.kill(process, signal.SIGCONT)
    except ProcessLookupError:
        return False
    # One that has ended waits for whom it belongs to now.
    return " Z " not in Path(f"/proc/{process}/stat").read_text()
