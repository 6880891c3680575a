"""Scenario files: found by name or path, read, and merged over their bases."""

import difflib
from importlib import resources
from pathlib import Path
from typing import Any

from mjspace.errors import InputError
from mjspace.scenario import raw
from mjspace.scenario.trust import controllers

_HALLMARKS = {"base", "description", "duration", "reference", "law"}
"""Keys of which a scenario has the first or all others."""

MOST_BASES = 20
"""Files based on each other."""


def scenario_names() -> list[str]:
    """Return the names of the scenarios that come with mjspace."""
    return list(_shipped())


def list_scenarios() -> dict[str, str]:
    """Return the description of each scenario that comes with mjspace, by name, unvalidated."""
    return {name: read(path)["description"] for name, path in _shipped().items()}


def subjects() -> dict[str, str]:
    """Return the subject of each shipped scenario's law, the folder in controllers/, by name."""
    folders = {name: full.split(".")[2] for name, full in controllers().items()}
    laws = {name: read(path)["law"]["kind"] for name, path in _shipped().items()}
    return {name: folders[law.partition(":")[0]] for name, law in laws.items()}


def find(scenario: str) -> Path:
    """Return the file of the scenario of that name or path.

    Raises:
        InputError: there is none, or it is another kind of file, with what would be right.
    """
    path = Path(scenario)
    if scenario in (shipped := _shipped()):
        return shipped[scenario]
    if path.is_dir():
        raise InputError(f"{scenario} is a folder: give a scenario's name or its TOML file")
    if path.is_file() and path.suffix != ".toml":
        raise InputError(f"{scenario} is not a scenario, a TOML file: {_purpose(path)}")
    if _is_path(scenario):
        if not path.is_file():
            raise InputError(f"no scenario file {scenario}")
        return path
    near = difflib.get_close_matches(scenario, shipped, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise InputError(f"no scenario {scenario!r}: {hint}'mjspace list' shows them")


def read(path: Path, upon: tuple[Path, ...] = ()) -> dict[str, Any]:
    """Return the file's table merged over its base's; ``upon`` are the files based on it.

    Raises:
        InputError: it cannot be read, is not a scenario, or its base is not.
    """
    try:
        table = raw.parsed(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: {error}") from None
    if not table.keys() & _HALLMARKS:
        have = ", ".join(table) or "nothing"
        raise InputError(f"{path} is not a scenario: it has {have}, but no duration or law")
    table.setdefault("name", path.stem)
    if "base" not in table:
        return table
    base, upon = table.pop("base"), (*upon, path.resolve())
    if len(upon) > MOST_BASES:
        raise InputError(f"{path}: base: more than {MOST_BASES} files are based on each other")
    if not isinstance(base, str):
        raise InputError(f"{path}: base: got {base!r}, should be a scenario's name or a path")
    try:
        below = find(str(path.parent / base) if _is_path(base) else base)
    except InputError as error:
        raise InputError(f"{path}: base: {error}") from None
    if below.resolve() in upon:
        raise InputError(f"{path}: base: {base!r} is based on this file itself")
    return _merged(read(below, upon), table)


def _shipped() -> dict[str, Path]:
    """Return the files of the scenarios that come with mjspace, by name."""
    folder = Path(str(resources.files("mjspace.scenarios")))
    return dict(sorted((path.stem, path) for path in folder.glob("*.toml")))


def _merged(base: dict[str, Any], table: dict[str, Any]) -> dict[str, Any]:
    """Return ``base`` with the keys of ``table``: tables merge, all else is replaced."""
    if "kind" in table and table["kind"] != base.get("kind"):
        return table  # the gains of one law mean nothing to another
    merged = dict(base)
    for key, value in table.items():
        old = base.get(key)
        tables = isinstance(value, dict) and isinstance(old, dict)
        merged[key] = _merged(base[key], value) if tables else value
    return merged


def _is_path(scenario: str) -> bool:
    return "/" in scenario or bool(Path(scenario).suffix)


def _purpose(path: Path) -> str:
    """Return what a file that is no scenario is for."""
    return {
        ".mcap": "it is the log of a flight, for 'mjspace replay', 'info', 'plot' or 'render'",
        ".xml": "a model is checked by 'mjspace validate --model', and named in [plant] model",
        ".urdf": "a model is checked by 'mjspace validate --model', and named in [plant] model",
        ".py": f'a law in it is named in a scenario\'s [law], as kind = "{path.name}:Class"',
    }.get(path.suffix, "'mjspace list' shows those that come with mjspace")
