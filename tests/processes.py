"""Which processes there are, for the tests that no process outlives another."""

from pathlib import Path


def in_session(leader: int) -> list[str]:
    """Return the commands of what still runs of the session that a process began; Linux only."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, session, *_ = (folder / "stat").read_text().rpartition(")")[2].split()
            if int(session) == leader and state != "Z":
                found.append((folder / "cmdline").read_text().replace("\0", " "))
        except OSError:
            continue  # it has ended meanwhile
    return found
