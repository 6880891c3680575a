"""Where a campaign writes: a folder, or a place on an object store, which fsspec opens."""

import os
from pathlib import Path
from typing import Any, cast

from mjspace.errors import InputError, missing


def place(text: str) -> Path:
    """Return what ``--out`` names: a path, or the URL of an object store, ``s3://bucket/folder``.

    A URL has the methods of ``Path``, and is none.

    Raises:
        InputError: a library is missing that knows the protocol; or it cannot be reached.
    """
    if "://" not in text:
        return Path(text)
    try:
        from upath import UPath
    except ImportError:
        raise missing(f"--out {text}: a URL", "universal-pathlib", "dask") from None
    try:
        found = UPath(text)
        found.exists()
    except Exception as error:  # of any library of a store
        message = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"--out {text}: {message}") from error
    return cast(Path, found)


def is_remote(path: Path) -> bool:
    """Return whether the path is that of an object store."""
    return not isinstance(path, Path)


def write_whole(path: Path, content: bytes) -> None:
    """Write a file as a whole or not at all, with the folders above it.

    A store has an object once it has all of it, and renames by copying; a disk has a file at once
    where it is renamed.

    Raises:
        OSError: it cannot be written.
    """
    if is_remote(path):
        remote: Any = path
        remote.fs.pipe_file(remote.path, content)
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f"{path.name}.part")
    unfinished.write_bytes(content)
    os.replace(unfinished, path)
