"""What the command line made of an input, in a process of its own, and what of that is a fault."""

import os
import resource
import sys
import time
import traceback
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

LIMIT = 20.0
"""Seconds after which a command hangs."""
MEMORY = 2 << 30
"""Bytes of memory that no command needs for a small input."""


class Outcome(NamedTuple):
    """Of a command: its exit status, or the signal that ended it, less than 0."""

    arguments: Sequence[str]
    status: int
    error: str
    seconds: float
    memory: int


def outcome(arguments: Sequence[str], folder: Path, limit: float = LIMIT) -> Outcome:
    """Run a command of mjspace in ``folder``, in a fork of this process: imports are not repeated.

    What it prints goes to the files ``.out`` and ``.err`` there.
    """
    sys.stdout.flush()
    begin = time.monotonic()
    child = os.fork()
    if not child:
        os._exit(_command(arguments, folder))
    ended, status, used = os.wait4(child, os.WNOHANG)
    while not ended and time.monotonic() - begin < limit:
        time.sleep(0.005)
        ended, status, used = os.wait4(child, os.WNOHANG)
    if not ended:
        os.kill(child, 9)
        _, status, used = os.wait4(child, 0)
    error = (folder / ".err").read_text(errors="replace")
    seconds = time.monotonic() - begin
    return Outcome(arguments, os.waitstatus_to_exitcode(status), error, seconds, _bytes(used))


def faults(found: Outcome) -> list[str]:
    """Return what is wrong with an outcome, whatever the input was."""
    lines = [line for line in found.error.splitlines() if not line.startswith("mjspace: warning: ")]
    wrong = []
    if found.seconds >= LIMIT:
        wrong.append(f"hangs: {found.seconds:.0f} s")
    elif found.status < 0:
        wrong.append(f"killed by signal {-found.status}")
    elif found.status not in (0, 1, 2, 3):
        wrong.append(f"status {found.status}")
    if "Traceback" in found.error:
        wrong.append(f"traceback: {lines[-1][:200]}")
    elif found.status == 2 and len(lines) != 1:
        wrong.append(f"{len(lines)} lines on stderr: {found.error[:200]!r}")
    if found.memory > MEMORY:
        wrong.append(f"takes {found.memory / 2**30:.1f} GiB")
    return wrong


def written(folder: Path) -> set[str]:
    """Return the names of what lies in ``folder``."""
    return {path.name for path in folder.iterdir()} - {".out", ".err"}


def _command(arguments: Sequence[str], folder: Path) -> int:
    """Be the child: run the command and return its status."""
    from mjspace import cli

    os.chdir(folder)
    for name, stream in ((".out", 1), (".err", 2)):
        os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
    sys.stdout, sys.stderr = (os.fdopen(stream, "w", closefd=False) for stream in (1, 2))
    sys.argv = ["mjspace", *arguments]
    warnings.simplefilter("default")  # pytest makes errors of them
    status = 0
    try:
        cli.main()
    except SystemExit as ended:
        status = ended.code if isinstance(ended.code, int) else 0 if ended.code is None else 1
    except BaseException:  # what ends a process with a traceback
        traceback.print_exc()
        status = 70
    sys.stdout.flush()
    sys.stderr.flush()
    return status


def _bytes(used: resource.struct_rusage) -> int:
    """Return the most memory that a child took, with what it shares with its parent."""
    return used.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
