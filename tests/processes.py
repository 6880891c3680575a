"""Which processes there are, for the tests that no process outlives another."""

import time
from pathlib import Path


def in_session(leader: int) -> list[str]:
    """Return the commands of what still runs of the session that a process began; Linux only."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, session, *_ = (folder / "stat").read_text().rpartition(")")[2].split()
            command = (folder / "cmdline").read_text().replace("\0", " ")
        except OSError:
            continue  # it has ended meanwhile
        if int(session) == leader and state != "Z" and command:  # an ending process has no command
            found.append(command)
    return found


def left_in_session(leader: int, seconds: float = 10.0) -> list[str]:
    """Return what still runs of that session after at most so many ``seconds``.

    What only ends when a pipe of its parent's closes, as multiprocessing's trackers do, ends a
    little later than the parent.
    """
    due = time.monotonic() + seconds
    while (left := in_session(leader)) and time.monotonic() < due:
        time.sleep(0.05)
    return left
