"""A campaign's folder: what it flies, and Parquet files with what its members did."""

import json
import math
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mjspace.campaign.flights import Flown
from mjspace.campaign.members import Population
from mjspace.campaign.places import is_remote, write_whole
from mjspace.campaign.results import (
    DESCRIPTION,
    WALL_TIME,
    JudgedResults,
    missing_column,
    value_column,
)
from mjspace.errors import InputError
from mjspace.log import lock
from mjspace.log.provenance import software
from mjspace.runner.checks import Verdict, margin
from mjspace.runner.output import make_folder

PART = 4096
"""Members in a file in the end: of a small file, most is its own description."""


class Store(JudgedResults):
    """The folder of one campaign."""

    def __init__(self, folder: Path, members: Population) -> None:
        """Name the ``folder``; nothing is read or written.

        Raises:
            InputError: Parquet's library is not installed.
        """
        super().__init__(folder, members.scenario)
        pyarrow = self._arrow
        self._members = members
        kinds = {"member": pyarrow.int64(), "seed": pyarrow.int64(), "passed": pyarrow.bool_()}
        kinds |= dict.fromkeys(self.draws, pyarrow.float64())
        for name in self.checks:
            kinds[f"{name}: measured"] = kinds[f"{name}: margin"] = pyarrow.float64()
            kinds[f"{name}: verdict"] = pyarrow.string()
        for metric in members.scenario.metrics:
            kinds[value_column(metric.name)] = pyarrow.float64()
            kinds[missing_column(metric.name)] = pyarrow.string()
        kinds |= {"trouble": pyarrow.string(), WALL_TIME: pyarrow.float64()}
        self._schema = pyarrow.schema(list(kinds.items()))

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Make the folder this campaign's alone, for as long as the context lasts.

        Raises:
            InputError: another campaign, or anything else, is in it; or another process has it.
            OSError: it cannot be written.
        """
        description = self.folder / DESCRIPTION
        here = self.folder.is_dir() and any(self.folder.iterdir())
        if here and not description.is_file():
            raise InputError(f"{self.folder}: holds something else: give another folder by --out")
        if here and self._files():  # else nothing is lost with what was tried before
            self._refuse_another(description)
        text = json.dumps(self._description(), indent=2).encode()
        if is_remote(self.folder):  # which has no locks, and nothing unfinished
            write_whole(description, text)
            yield
            return
        make_folder(self._blocks)
        with (self.folder / "lock").open("ab") as file:
            if not lock.lock(file.fileno()):
                raise InputError(f"{self.folder}: another process flies this campaign")
            for left in self._blocks.glob("*.part"):
                left.unlink()
            write_whole(description, text)
            yield

    def _description(self) -> dict[str, Any]:
        members = self._members
        return {
            "name": members.scenario.name,
            "seed": members.scenario.seed,
            "members": members.campaign.count,
            **members.identity,
            "software": software(),
        }

    def _refuse_another(self, description: Path) -> None:
        """Refuse to go on with another campaign than the folder's."""
        try:
            old = json.loads(description.read_text())
            count = int(old["members"])
        except (ValueError, TypeError, KeyError):
            raise InputError(f"{description}: is no description of a campaign") from None
        new, hint = self._description(), "give another folder by --out"
        for key in ("name", "seed", "scenario", "sources", "software"):
            if old.get(key) != new[key]:
                what = f"{key} {old.get(key)}, not {new[key]}"
                if key == "scenario":
                    what = f"another scenario: {_first_difference(str(old[key]), new[key])}"
                elif key in ("sources", "software"):
                    what = f"other {key}: {_differing(old.get(key), new[key])}"
                raise InputError(f"{self.folder}: holds a campaign of {what}: {hint}")
        if new["members"] < count:
            raise InputError(f"{self.folder}: holds {count} members: --n {count} or more goes on")
        if new["members"] != count and self._members.scenario.sampling == "latin_hypercube":
            raise InputError(
                f"{self.folder}: holds a Latin hypercube of {count} members, which cannot grow: "
                f"--n {count}, or {hint}"
            )

    def write(self, flown: Sequence[Flown]) -> None:
        """Write a block of members, as a whole or not at all.

        Raises:
            OSError: it cannot be written.
        """
        rows = [self._row(one) for one in flown]
        self._write(self._arrow.Table.from_pylist(rows, schema=self._schema))

    def compact(self, parts: Iterable[int]) -> None:
        """Put the files of each of the parts, of which every member has been flown, into one.

        A part is ``PART`` members; its files are removed once the one is there.

        Raises:
            InputError: a file is damaged.
            OSError: it cannot be written.
        """
        files: dict[int, list[Path]] = defaultdict(list)
        for path in self._files():
            files[int(path.stem.partition("-")[0]) // PART].append(path)
        for part in parts:
            if len(files[part]) > 1:
                whole = self._whole([self._table(path, None) for path in files[part]])
                written = self._write(whole)
                for path in files[part]:
                    if path.name != written.name:
                        path.unlink()

    def _write(self, table: Any) -> Path:
        """Write a table of consecutive members, as a whole or not at all; return its file."""
        first, last = (table["member"][i].as_py() for i in (0, -1))
        sink = self._arrow.BufferOutputStream()
        self._arrow.parquet.write_table(table, sink)
        path = self._blocks / f"{first:08d}-{last:08d}.parquet"
        write_whole(path, sink.getvalue().to_pybytes())
        return path

    def _row(self, flown: Flown) -> dict[str, Any]:
        numbers = [x for each in flown.draws for x in (each if isinstance(each, list) else [each])]
        row: dict[str, Any] = {
            "member": flown.member,
            "seed": self._members.scenario.seed,
            "passed": flown.passed,
            **{name: float(x) for name, x in zip(self.draws, numbers, strict=True)},
            "trouble": flown.trouble,
            WALL_TIME: flown.seconds,
        }
        verdicts = flown.verdicts or [Verdict(c, math.nan) for c in self.checks.values()]
        for name, verdict in zip(self.checks, verdicts, strict=True):
            row[f"{name}: measured"] = _number(verdict.measured)
            row[f"{name}: margin"] = _number(margin(verdict.check, verdict.measured))
            row[f"{name}: verdict"] = verdict.outcome
        for metric in self.scenario.metrics:
            row[value_column(metric.name)] = row[missing_column(metric.name)] = None
        for measured in flown.metrics:
            row[value_column(measured.metric.name)] = _number(measured.value)
            row[missing_column(measured.metric.name)] = measured.missing or None
        return row

    def _empty(self) -> Any:
        return self._schema.empty_table()


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value


def _first_difference(old: str, new: str) -> str:
    """Return the first lines that differ."""
    for one, other in zip(old.splitlines(), new.splitlines(), strict=False):
        if one != other:
            return f"{re.sub(' +', ' ', one)}, not {re.sub(' +', ' ', other)}"
    return "one is longer"


def _differing(old: Any, new: dict[str, str]) -> str:
    old = old if isinstance(old, dict) else {}
    return ", ".join(k for k in {**old, **new} if old.get(k) != new.get(k))
