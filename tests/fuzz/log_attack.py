"""Every command against one log, and what it must do."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from random import Random

from logs import Case
from outcomes import Commands, faults, written

COMMANDS = {
    "info": ("info", "x.mcap"),
    "json": ("info", "x.mcap", "--json"),
    "recover": ("recover", "x.mcap", "-o", "good.mcap"),
    "verify": ("replay", "x.mcap", "--verify"),
    "replay": ("replay", "x.mcap", "--out", "out"),
    "plot": ("plot", "x.mcap", "-o", "x.png"),
    "report": ("report", "x.mcap", "-o", "x.html"),
    "render": ("render", "x.mcap", "-o", "y.png"),
}
WRITES = {
    "recover": "good.mcap",
    "replay": "out",
    "plot": "x.png",
    "report": "x.html",
    "render": "y.png",
}
"""What a command may leave behind, where it succeeds."""
LITTLE = ("info", "recover", "verify")
"""Commands that are always tried; one of the others is by chance, for its time."""
OTHERS = (*("json",) * 3, *("replay",) * 4, "plot", "report", "render")


def attack(case: Case, folder: Path, commands: Commands, *, every: bool) -> Iterator[str]:
    """Yield the faults of the ``commands`` on a ``case``, in the empty ``folder``.

    ``every`` command, or those that take little time and one other.
    """
    (folder / "x.mcap").write_bytes(case.content)
    random = Random(case.name)
    for name in COMMANDS if every else (*LITTLE, random.choice(OTHERS)):
        before = written(folder)
        found = commands.outcome(COMMANDS[name], folder)
        for fault in faults(found):
            yield f"{name}: {fault}"
        extra = written(folder) - before
        if extra - {WRITES.get(name)}:
            yield f"{name}: wrote {sorted(extra)}"
        if extra and found.status == 2:
            yield f"{name}: refused it and wrote {sorted(extra)}"
        if name == "verify" and found.status == 0 and case.must_differ:
            yield "verify: a poisoned log is called identical"
        if name == "recover" and found.status == 0:
            read = commands.outcome(("info", "good.mcap"), folder)
            if read.status or faults(read):
                yield f"recover: what it wrote is not read: {read.error.strip()[:200]}"
        for left in written(folder) - before:
            path = folder / left
            shutil.rmtree(path) if path.is_dir() else path.unlink()
