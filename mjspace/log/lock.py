"""Which run writes a log: a lock that ends with its process, where the file system has locks."""

import fcntl
import os
from pathlib import Path
from typing import BinaryIO


def create(path: Path) -> BinaryIO:
    """Return a new file, locked until it is closed; no link is followed.

    Raises:
        FileExistsError: there is something already, or another run has just taken it.
        OSError: it cannot be written.
    """
    file = path.open("xb", buffering=0)
    if not lock(file.fileno()):
        file.close()
        raise FileExistsError(f"{path}: another run replaces it")
    return file


def lock(descriptor: int, kind: int = fcntl.LOCK_EX) -> bool:
    """Lock an open file; return False if another process has it locked.

    Where the file system has no locks it counts as locked.
    """
    try:
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        pass
    return True


def remove(path: Path) -> bool:
    """Remove a file, or a link itself; return False, and leave it, if a run is writing it.

    Nothing there is nothing to remove.

    Raises:
        OSError: it cannot be removed.
    """
    flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
    try:
        descriptor = os.open(path, flags)
    except OSError:
        path.unlink(missing_ok=True)
        return True
    try:
        # Who removes a log holds its lock: nobody else can have put another there since.
        locked = lock(descriptor) and os.path.samestat(os.fstat(descriptor), path.lstat())
        if locked:
            path.unlink()
        return locked
    except FileNotFoundError:
        return False
    finally:
        os.close(descriptor)


def is_locked(path: Path) -> bool:
    """Return whether another process is writing the file; False where none can be read."""
    flags = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
    try:
        descriptor = os.open(path, flags)
    except OSError:
        return False
    try:
        return not lock(descriptor, fcntl.LOCK_SH)
    finally:
        os.close(descriptor)
