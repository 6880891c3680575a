"""What the command line made of an input, in another process, and what of that is a fault."""

import os
import resource
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Sequence
from multiprocessing import Pipe
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

LIMIT = 20.0
"""Seconds after which a command hangs."""
MEMORY = 2 << 30
"""Bytes of memory that no command needs for a small input."""
IN_A_ROW = 50
"""Commands that one process runs."""


class Outcome(NamedTuple):
    """Of a command: its exit status, or the signal that ended it, less than 0."""

    arguments: Sequence[str]
    status: int
    error: str
    seconds: float
    memory: int


class Commands:
    """A fork of this process that runs one command after another, and is replaced when it dies.

    What this process has imported and compiled is not done again.
    """

    def __init__(self) -> None:
        self._child = self._ran = 0
        self._pipe: Any = None

    def __enter__(self) -> "Commands":
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def outcome(self, arguments: Sequence[str], folder: Path, limit: float = LIMIT) -> Outcome:
        """Run a command of mjspace in ``folder``.

        What it prints goes to the files ``.out`` and ``.err`` there.
        """
        if self._ran == IN_A_ROW:
            self._end()
        if not self._child:
            self._begin()
        self._ran += 1
        begin = time.monotonic()
        self._pipe.send((arguments, folder))
        try:
            alive = self._pipe.poll(limit)
            status, memory = self._pipe.recv() if alive else self._end(signal.SIGKILL)
        except (EOFError, ConnectionResetError):
            status, memory = self._end()
        seconds = time.monotonic() - begin
        if memory > MEMORY:  # also of what it runs afterwards
            self._end()
        error = (folder / ".err").read_text(errors="replace")
        return Outcome(arguments, status, error, seconds, memory)

    def _begin(self) -> None:
        self._pipe, theirs = Pipe()
        sys.stdout.flush()
        with warnings.catch_warnings():
            # Python 3.12 warns of the threads of NumPy's linear algebra; the fork needs none.
            warnings.simplefilter("ignore", DeprecationWarning)
            self._child, self._ran = os.fork(), 0
        if not self._child:
            self._pipe.close()
            _serve(theirs)
        theirs.close()

    def _end(self, number: int = 0) -> tuple[int, int]:
        """End the process, by a signal if there is one; return its exit status and its memory."""
        if not self._child:
            return 0, 0
        self._pipe.close()
        if number:
            os.kill(self._child, number)
        _, status, used = os.wait4(self._child, 0)
        self._child = 0
        return os.waitstatus_to_exitcode(status), _bytes(used)


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


def _serve(requests: Any) -> NoReturn:
    """Be the child: run the commands that are requested, until there are no more."""
    while True:
        try:
            arguments, folder = requests.recv()
        except EOFError:
            os._exit(0)
        status = _command(arguments, folder)
        requests.send((status, _bytes(resource.getrusage(resource.RUSAGE_SELF))))


def _command(arguments: Sequence[str], folder: Path) -> int:
    """Run the command and return its status."""
    from mjspace import cli

    os.chdir(folder)
    for name, stream in ((".out", 1), (".err", 2)):
        file = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(file, stream)
        os.close(file)
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
    """Return the most memory that a process took, with what it shares with its parent."""
    return used.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
