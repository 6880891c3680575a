"""Where a run writes its log: nothing is overwritten unasked, and no two runs write one."""

import os
from pathlib import Path

from mjspace.errors import InputError
from mjspace.log import lock

LOG = "flight.mcap"
"""The log's name in the folder of its run."""


def refuse_existing(path: Path, *, force: bool) -> None:
    """Refuse a log that is there already, unless ``force`` may replace it.

    Raises:
        InputError: it may not; or it is no file, or another run is writing it.
    """
    if not os.path.lexists(path):
        return
    if path.is_dir() and not path.is_symlink():
        raise InputError(f"{path}: is a folder, where the log would be: give another by --out")
    if lock.is_locked(path):
        raise _being_written(path)
    if not force:
        raise exists(path)


def remove(path: Path) -> None:
    """Remove the log that is to be replaced, if there is one; of a link, the link alone.

    Raises:
        InputError: another run is writing it.
        OSError: it cannot be removed.
    """
    if not lock.remove(path):
        raise _being_written(path)


def exists(path: Path) -> InputError:
    """Return the error that refuses to overwrite a log."""
    return InputError(
        f"{path}: is there already: give another folder by --out, or --force to replace it"
    )


def _being_written(path: Path) -> InputError:
    return InputError(f"{path}: another run is writing it: give another folder by --out")
