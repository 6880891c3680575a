"""What a campaign's folder holds of the members flown: its Parquet files, read."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.log.arrow import pyarrow_for


class Results:
    """The members of a campaign that have been flown."""

    def __init__(self, folder: Path) -> None:
        """Name the ``folder``; nothing is read.

        Raises:
            InputError: Parquet's library is not installed.
        """
        self._arrow = pyarrow_for("a campaign")
        self.folder, self._blocks = folder, folder / "members"

    def finished(self) -> set[int]:
        """Return the members that have been flown."""
        found: set[int] = set()
        for path in self._files():
            found |= set(self._table(path, ["member"])["member"].to_pylist())
        return found

    def read(self, columns: Sequence[str] | None = None) -> Any:
        """Return the table of all members flown, or these columns of it, in their order.

        Raises:
            InputError: there is none, or a file is damaged.
        """
        chosen = None if columns is None else list(dict.fromkeys(["member", *columns]))
        tables = [self._table(path, chosen) for path in self._files()]
        if not tables:
            return self._empty()
        return self._arrow.concat_tables(tables).sort_by("member").combine_chunks()

    def column(self, name: str) -> Array:
        """Return a column of numbers, nan where there is none."""
        found: Array = np.array(self.read([name])[name].to_numpy(zero_copy_only=False), dtype=float)
        return found

    def row(self, member: int) -> dict[str, Any]:
        """Return all that the table has of a member.

        Raises:
            KeyError: it has not been flown.
        """
        for path in self._files():
            first, last = map(int, path.stem.split("-"))
            if first <= member <= last:
                found: dict[str, Any] = (
                    self._table(path, None).slice(member - first, 1).to_pylist()[0]
                )
                return found
        raise KeyError(member)

    def _empty(self) -> Any:
        raise InputError(f"{self.folder}: holds no member of a campaign")

    def _files(self) -> list[Path]:
        return sorted(self._blocks.glob("*.parquet"))

    @property
    def columns(self) -> list[str]:
        """The names of all columns; none where nothing has been flown."""
        files = self._files()
        return self._table(files[0], None).column_names if files else []

    def _table(self, path: Path, columns: list[str] | None) -> Any:
        try:
            return self._arrow.parquet.read_table(path, columns=columns)
        except self._arrow.ArrowInvalid as error:
            raise InputError(f"{path}: {error}: remove it, and its members fly again") from error
