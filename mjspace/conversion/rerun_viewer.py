"""Rerun's viewer, opened with a log."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from mjspace.conversion.convert import convert
from mjspace.conversion.rerun import rerun_for
from mjspace.log.reader import Log
from mjspace.rendering.graphics import has_display

_POLL = 0.1  # s
_GRACE = 5.0  # s that the viewer has to end


def require_rerun() -> None:
    """Refuse to go on without Rerun.

    Raises:
        InputError: it is not installed, with what installs it.
    """
    rerun_for("--with rerun")


def show(log: Log, stop: Callable[[], bool], progress: Callable[[float], None]) -> None:
    """Open the viewer with a recording of the log, until it is closed or ``stop`` returns True.

    In a window, or in a browser where there is no display. The recording is in a temporary folder,
    and is removed in the end. ``progress`` is called with the time [s] up to which it is written.

    Raises:
        InputError: the log is damaged, or Rerun is not installed.
        OSError: the recording cannot be written, or the viewer ended with an error, which it has
            printed.
    """
    with tempfile.TemporaryDirectory(prefix="mjspace-rerun-") as folder:
        recording = Path(folder) / "flight.rrd"
        convert(log, recording, progress=progress)
        # In a session of its own: Rerun's command is a process that starts another.
        viewer = subprocess.Popen(command(recording), start_new_session=True)
        try:
            while viewer.poll() is None and not stop():
                time.sleep(_POLL)
        finally:
            ended = viewer.poll()
            _end(viewer)
    if ended:
        raise OSError(f"view: Rerun's viewer ended with exit status {ended}")


def command(recording: Path) -> list[str]:
    """Return what opens the viewer: on this machine alone, where Rerun would serve on every one."""
    where = [] if has_display() else ["--web-viewer"]
    return [sys.executable, "-m", "rerun", str(recording), "--bind", "127.0.0.1", *where]


def _end(viewer: "subprocess.Popen[bytes]") -> None:
    with suppress(ProcessLookupError):
        os.killpg(viewer.pid, signal.SIGTERM)
    try:
        viewer.wait(_GRACE)
    except subprocess.TimeoutExpired:
        with suppress(ProcessLookupError):
            os.killpg(viewer.pid, signal.SIGKILL)
        viewer.wait()
