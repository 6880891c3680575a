"""Two-line elements out of a file, as catalogues publish them: read once, with the scenario.

The table then has the lines themselves, so that all that flies it, and its log, need no file.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mjspace.errors import InputError, nearest, shortened
from mjspace.scenario.trust import Trust

_LARGEST = 64_000_000
"""Bytes: some ten times all that is in orbit."""
_SHOWN = 5
"""Satellites that an error lists."""
_KEY = "environment.orbit.tle_file"


@dataclass(frozen=True)
class Satellite:
    """A satellite of a file."""

    name: str
    """Of the line before its two; empty where there is none."""
    lines: tuple[str, str]
    row: int
    """Of the first of the two, counted from 1."""

    @property
    def number(self) -> str:
        """The catalogue number, as the lines have it: digits, or a letter and digits."""
        return self.lines[0][2:7].strip()

    @property
    def label(self) -> str:
        """Its name and number."""
        return f"{self.name} ({self.number})" if self.name else self.number

    def answers_to(self, text: str) -> bool:
        """Return whether ``text`` is its name, in capitals or not, or its catalogue number."""
        if text.isascii() and text.isdigit() and self.number.isdigit():
            return int(text) == int(self.number)
        return bool(text) and text.casefold() in (self.name.casefold(), self.number.casefold())


def put_lines(table: dict[str, Any], scenario: Path, origins: dict[str, str]) -> None:
    """Replace ``tle_file`` and ``satellite`` of the scenario's orbit by the satellite's ``tle``.

    The file is looked up from the folder of the ``scenario``. ``origins``, what set each key, gets
    where the lines are from.

    Raises:
        InputError: the file cannot be read, or has no such satellite, or several.
    """
    environment = table.get("environment")
    if not isinstance(environment, dict):
        return
    orbit = environment.get("orbit")
    if not isinstance(orbit, dict) or "tle_file" not in orbit or "tle" in orbit:
        return  # the table of the orbit says what is wrong, if anything is
    name, wanted = orbit["tle_file"], orbit.get("satellite")
    of_text = isinstance(wanted, str | int) and not isinstance(wanted, bool)
    if not isinstance(name, str) or not (wanted is None or of_text):
        return
    where = origins.get(_KEY, str(scenario))
    try:
        path = _file(name, scenario.parent)
        found = _chosen(list(satellites(path.read_text(encoding="utf-8"))), wanted)
    except (OSError, ValueError) as error:
        raise InputError(f"{where}: {_KEY}: {name}: {error}") from None
    kept = {key: value for key, value in orbit.items() if key not in ("tle_file", "satellite")}
    environment["orbit"] = kept | {"tle": list(found.lines)}
    origins["environment.orbit.tle"] = f"{path}, from line {found.row} on, {found.label}"


def satellites(text: str) -> Iterator[Satellite]:
    """Yield the satellites of a catalogue: two lines each, with or without a name before them.

    Raises:
        ValueError: a line does not belong to one, with its number.
    """
    rows = [(row, line.rstrip()) for row, line in enumerate(text.splitlines(), start=1)]
    rows = [(row, line) for row, line in rows if line.strip()]
    name, at = "", 0
    while at < len(rows):
        row, line = rows[at]
        following = rows[at + 1][1] if at + 1 < len(rows) else ""
        if line.startswith("1 ") and following.startswith("2 "):
            yield Satellite(name, (line, following), row)
            name, at = "", at + 2
        elif not name and following.startswith("1 "):
            name, at = line.removeprefix("0 ").strip(), at + 1
        else:
            raise ValueError(
                f"line {row} is {shortened(line)!r}: a satellite is two lines, which begin with 1 "
                "and 2, with a line before them for its name or without"
            )


def _file(name: str, folder: Path) -> Path:
    """Return the file of that ``name``, which is one to read."""
    try:
        path = Trust(folder).file(name)
    except ValueError:
        raise ValueError(
            "is outside the scenario's folder: copy it there, or name it by --set"
        ) from None
    if not path.is_file():
        raise ValueError(f"no file {path}")
    if (size := path.stat().st_size) > _LARGEST:
        raise ValueError(f"has {size} bytes, should have at most {_LARGEST}")
    return path


def _chosen(found: list[Satellite], wanted: str | int | None) -> Satellite:
    """Return the one satellite that is ``wanted``, or that there is."""
    if not found:
        raise ValueError("has no satellite")
    matching = found
    if wanted is not None:
        text = str(wanted).strip()
        matching = [satellite for satellite in found if satellite.answers_to(text)]
        if not matching:
            names = [satellite.name or satellite.number for satellite in found]
            raise ValueError(f"no satellite {shortened(text)!r}{_near(text, names)}")
    if len(matching) == 1:
        return matching[0]
    if wanted is None:
        labels = ", ".join(satellite.label for satellite in found[:_SHOWN])
        more = ", ..." if len(found) > _SHOWN else ""
        raise ValueError(
            f"has {len(found)} satellites: say which by environment.orbit.satellite, its name or "
            f"catalogue number: {labels}{more}"
        )
    rows = ", ".join(str(satellite.row) for satellite in matching[:_SHOWN])
    raise ValueError(
        f"has {len(matching)} satellites {str(wanted)!r}, on lines {rows}: give the catalogue "
        "number, or leave one set of lines in the file"
    )


def _near(text: str, names: list[str]) -> str:
    """Return the nearest of many names, for an error; all of few."""
    if len(names) <= _SHOWN:
        return nearest(text, names)
    close = nearest(text, names).partition("(have")[0]
    return close if "did you mean" in close else f": it has {len(names)} others"
