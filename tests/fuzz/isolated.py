"""A case tried in a process of its own: a crash, a hang or a hoard of memory ends that alone."""

import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path

SECONDS = 20.0
"""A case that takes longer hangs."""
MEMORY = 6 * 2**30
"""Bytes of address space beyond what the process has already."""


def outcome(attempt: Callable[[], str]) -> str:
    """Return what ``attempt`` says in a fork of this process: "" where all is well.

    Otherwise it is what it raised, that it crashed or that it hangs. Its working folder is an empty
    one of its own.
    """
    with tempfile.TemporaryDirectory() as folder:
        said = Path(folder) / "said"
        (Path(folder) / "work").mkdir()
        child = os.fork()
        if not child:
            _attempted(attempt, said)
        deadline = time.monotonic() + SECONDS
        while time.monotonic() < deadline:
            ended, status = os.waitpid(child, os.WNOHANG)
            if ended:
                break
            time.sleep(0.002)
        else:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return f"hangs: took more than {SECONDS:g} s"
        if os.WIFSIGNALED(status):
            return f"crashed by {signal.Signals(os.WTERMSIG(status)).name}"
        return said.read_text() if said.exists() else "ended by itself"


def _attempted(attempt: Callable[[], str], said: Path) -> None:
    """Write what ``attempt`` says and end the process."""
    try:
        os.chdir(said.parent / "work")
        nothing = os.open(os.devnull, os.O_RDWR)
        for stream in range(3):
            os.dup2(nothing, stream)
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
        said.write_text(attempt())
    except BaseException:
        said.write_text(traceback.format_exc())
    finally:
        sys.stdout = sys.stderr = None
        os._exit(0)
