"""What a campaign's folder holds of the members flown: its Parquet files, read."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.errors import InputError, input_error_at
from mjspace.log.arrow import pyarrow_for
from mjspace.runner.checks import NO_CRASH
from mjspace.scenario import raw
from mjspace.scenario.loading import validate
from mjspace.scenario.scenario import Check, Scenario

DESCRIPTION = "campaign.json"
WALL_TIME = "wall_time"
"""The one column that differs from flight to flight."""


def draw_columns(scenario: Scenario) -> list[str]:
    """Return the name of the column of each number drawn."""
    found: list[str] = []
    for dispersion in scenario.dispersions:
        count = {"random_attitude": 4, "on_sphere": 3}.get(dispersion.distribution)
        for key in dispersion.all_keys:
            found += [key] if count is None else [f"{key}[{i}]" for i in range(count)]
    return found


def value_column(metric: str) -> str:
    """Return the name of the column of the metric's values."""
    return f"{metric}: value"


def missing_column(metric: str) -> str:
    """Return the name of the column that says why a member has no value of the metric."""
    return f"{metric}: missing"


def checks_of(scenario: Scenario) -> dict[str, Check]:
    """Return the checks of each flight, by names that are made unique."""
    checks = list(scenario.checks)
    if scenario.plant.ground is not None and all(c.signal != NO_CRASH.signal for c in checks):
        checks.append(NO_CRASH)
    found: dict[str, Check] = {}
    for check in checks:
        number = sum(check.name == other.name for other in found.values())
        found[f"{check.name} ({number + 1})" if number else check.name] = check
    return found


class Results:
    """The members of a campaign that have been flown."""

    def __init__(self, folder: Path) -> None:
        """Name the ``folder``; nothing is read.

        Raises:
            InputError: Parquet's library is not installed.
        """
        self._arrow = pyarrow_for("a campaign")
        self.folder, self._blocks = folder, folder / "members"

    def read(self, columns: Sequence[str] | None = None) -> Any:
        """Return the table of all members flown, or these columns of it, in their order.

        Raises:
            InputError: there is none, or a file is damaged.
        """
        chosen = None if columns is None else list(dict.fromkeys(["member", *columns]))
        tables = [self._table(path, chosen) for path in self._files()]
        if not tables:
            return self._empty()
        return self._whole(tables)

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

    def _whole(self, tables: Sequence[Any]) -> Any:
        """Return one table of the members of several, in their order.

        A member may be in two files: small ones are removed once a large one has what they have.
        """
        table = self._arrow.concat_tables(tables).sort_by("member").combine_chunks()
        member = table["member"].to_numpy()
        first = np.append(True, member[1:] != member[:-1])[: len(member)]
        return table if first.all() else table.filter(first).combine_chunks()

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
            with path.open("rb") as file:
                return self._arrow.parquet.read_table(file, columns=columns)
        except self._arrow.ArrowInvalid as error:
            raise InputError(f"{path}: {error}: remove it, and its members fly again") from error


class JudgedResults(Results):
    """The members that have been flown, with the checks and dispersions of their scenario."""

    def __init__(self, folder: Path, scenario: Scenario) -> None:
        """Name the ``folder``; nothing is read.

        Raises:
            InputError: Parquet's library is not installed.
        """
        super().__init__(folder)
        self.scenario = scenario
        self.draws, self.checks = draw_columns(scenario), checks_of(scenario)


def results_in(folder: Path) -> JudgedResults:
    """Return the results of the campaign in a folder, of which the scenario may be gone.

    Raises:
        InputError: there is none, or it is not valid for this version of mjspace.
    """
    description = folder / DESCRIPTION
    with input_error_at(str(description)):
        found = json.loads(description.read_text(encoding="utf-8"))
        text = found.get("scenario") if isinstance(found, dict) else None
        if not isinstance(text, str):
            raise ValueError("is no description of a campaign")
        table = raw.parsed(text)
    scenario = validate(table, f"the scenario in {description}", context={"flown": True})
    results = JudgedResults(folder, scenario)
    columns = results.columns
    if not columns:
        raise InputError(f"{folder}: holds no member of a campaign")
    of_checks = [
        f"{n}: {what}" for n in results.checks for what in ("measured", "margin", "verdict")
    ]
    of_metrics = [
        column(metric.name)
        for metric in scenario.metrics
        for column in (value_column, missing_column)
    ]
    for name in ("passed", "trouble", WALL_TIME, *results.draws, *of_checks, *of_metrics):
        if name not in columns:
            raise InputError(f"{folder}: its members lack {name!r}")
    return results
