"""Gains that come from a file: the columns of a CSV file, or the arrays of NumPy's .npz."""

import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from mjspace.errors import shortened


def gains_in(path: Path) -> dict[str, Any]:
    """Return the gains in a file: ``arrays`` of an .npz, ``columns`` of any other.

    Raises:
        ValueError: as these.
    """
    return arrays(path) if path.suffix == ".npz" else columns(path)


def arrays(path: Path) -> dict[str, Any]:
    """Return the arrays of an .npz file as lists; ``w0, w1, ...`` become one list ``w``.

    Raises:
        ValueError: no such file, or anything in it but arrays of finite numbers, with the file.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            found = {name: file[name] for name in file.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise ValueError(f"file: {path} cannot be read: {error}") from None
    for name, array in found.items():
        if array.dtype.kind not in "fiu" or not np.isfinite(array).all():
            raise ValueError(f"file: {path}: {name} should be an array of finite numbers")
    return {
        base: found[base].tolist() if parts == [base] else [found[p].tolist() for p in parts]
        for base, parts in _numbered(found, f"file: {path}").items()
    }


def columns(path: Path) -> dict[str, Any]:
    """Return a CSV file's columns by their header; ``q0, q1, ...`` become one array ``q``.

    Empty lines and text after a ``#`` are ignored, except in the header.

    Raises:
        ValueError: no such file, no header, rows of unequal length, or text that is not a number,
            with the file and the line.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"file: {path} cannot be read: {error}") from None
    names = [name.strip() for name in lines[0].lstrip("# ").split(",")] if lines else []
    if not names or not all(name.isidentifier() for name in names):
        raise ValueError(
            f"file: {path}, line 1: got {shortened(', '.join(names))!r}, should be a header of the "
            "gains' names, as in time,attitude0,attitude1,attitude2,attitude3"
        )
    rows = []
    for number, line in enumerate(lines[1:], start=2):
        cells = [cell.strip() for cell in line.partition("#")[0].split(",")]
        if cells == [""]:
            continue
        if len(cells) != len(names):
            raise ValueError(
                f"file: {path}, line {number}: got {len(cells)} values, the header has {len(names)}"
            )
        rows.append([_number(cell, path, number) for cell in cells])
    if not rows:
        raise ValueError(f"file: {path}: no row of numbers below the header")
    groups = _numbered(names, f"file: {path}, line 1")
    table = dict(zip(names, np.array(rows).T.tolist(), strict=True))
    return {
        base: table[base] if parts == [base] else np.array([table[p] for p in parts]).T.tolist()
        for base, parts in groups.items()
    }


def _numbered(names: Iterable[str], where: str) -> dict[str, list[str]]:
    """Return the names ``q0, q1, ...`` under their base ``q``, in order, and others alone."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(name.rstrip("0123456789"), []).append(name)
    for base, parts in groups.items():
        right = [base] if parts == [base] else [f"{base}{i}" for i in range(len(parts))]
        if parts != right:
            raise ValueError(f"{where}: got {shortened(str(parts))}, should be {right}")
    return groups


def _number(cell: str, path: Path, line: int) -> float:
    try:
        return float(cell)
    except ValueError:
        raise ValueError(
            f"file: {path}, line {line}: got {shortened(cell)!r}, should be a number"
        ) from None
