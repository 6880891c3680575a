"""Temporary folders that outlive a kill only until the next of them is made."""

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mjspace.log import lock

PREFIX = "mjspace-unpacked-"


@contextmanager
def folder() -> Iterator[Path]:
    """Yield an empty folder that only this user can read, and remove it in the end.

    It is locked meanwhile; before, those of this user whose processes have ended are removed.

    Raises:
        OSError: none can be made.
    """
    place = Path(tempfile.gettempdir())
    for left in place.glob(f"{PREFIX}????????"):
        _remove_unlocked(left)
    while True:  # until no other process takes it for one that was left, before it is locked
        made = Path(tempfile.mkdtemp(prefix=PREFIX, dir=place))
        try:
            descriptor = os.open(made, os.O_RDONLY)
        except FileNotFoundError:
            continue
        if lock.lock(descriptor) and made.exists():
            break
        os.close(descriptor)
    try:
        yield made
    finally:
        shutil.rmtree(made, ignore_errors=True)
        os.close(descriptor)


def _remove_unlocked(left: Path) -> None:
    """Remove a folder of this user's that no process has locked; no link is followed."""
    with suppress(OSError):  # it is none, or is locked, or has no locks: it stays
        descriptor = os.open(left, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.fstat(descriptor).st_uid == os.getuid():
                shutil.rmtree(left, ignore_errors=True)
        finally:
            os.close(descriptor)
