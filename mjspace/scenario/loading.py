"""Reading scenarios: find the file, apply overrides, validate, say in one line what is wrong."""

import difflib
import re
import tomllib
import warnings
from collections.abc import Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import BaseModel, ValidationError

from mjspace.errors import InputError, nearest
from mjspace.scenario import overrides as keys
from mjspace.scenario.construct import plain
from mjspace.scenario.declared import tables_in, type_of
from mjspace.scenario.scenario import Component, Scenario
from mjspace.scenario.sensors import kinds


def scenario_names() -> list[str]:
    """Return the names of the scenarios that come with mjspace."""
    folder = resources.files("mjspace.scenarios")
    return sorted(p.name[:-5] for p in folder.iterdir() if p.name.endswith(".toml"))


def list_scenarios() -> dict[str, str]:
    """Return the description of each scenario that comes with mjspace, by name, unvalidated."""
    return {name: _read(_find(name), ())["description"] for name in scenario_names()}


def load(scenario: str | Path, overrides: Iterable[str] = ()) -> tuple[Scenario, Path]:
    """Return the scenario of that name or path, and the folder its own files are beside.

    A file may say ``base``: another scenario, by its name or by a path from the file's folder,
    whose tables it changes key by key. A table of another ``kind`` replaces the base's as a whole.
    ``overrides``, which come last, are ``key=value`` with a dotted key and a TOML value; a bare
    word is a string. Under an overriding ``duration``, checks whose window begins after the
    flight's end are left out, with a warning; in a file they are an error.

    Raises:
        InputError: no such scenario, no TOML, or a key that is wrong; one line.
    """
    path = _find(str(scenario))
    table = _read(path, ())
    origins = keys.apply(table, overrides)
    cut = {"cut_short": "duration" in origins}
    found = validate(table, str(path), origins, context=cut)
    late = [check for check in found.checks if check.begins_too_late(found.duration)]
    if late:
        names = ", ".join(repr(check.name) for check in late)
        warnings.warn(
            f"checks that begin after the flight's end, {found.duration:g} s, left out: {names}",
            stacklevel=2,
        )
        kept = [check for check in found.checks if check not in late]
        found = found.model_copy(update={"checks": kept})
    return found, path.parent


def validate(
    table: dict[str, Any],
    where: str,
    origins: Mapping[str, str] = {},
    context: Mapping[str, bool] = {},
) -> Scenario:
    """Return the scenario that ``table`` holds.

    Under the ``context`` "flown" it is that of a log, under "cut_short" checks may begin after the
    flight's end.

    Raises:
        InputError: one line with all that is wrong: the file (or the option that set the key), the
            key, what was found and what would be right.
    """
    try:
        return Scenario.model_validate(table, context=dict(context))
    except ValidationError as error:
        by_source: dict[str, list[str]] = {}
        for problem in error.errors():
            text = _explain(".".join(str(part) for part in problem["loc"]), problem)
            key = text.partition(":")[0]
            source = next((o for k, o in origins.items() if _related(k, key)), where)
            by_source.setdefault(source, []).append(text)
        raise InputError("; ".join(f"{s}: {'; '.join(p)}" for s, p in by_source.items())) from None


def component(kind: str, gains: Iterable[str]) -> Component:
    """Return a law or reference from its kind and ``key=value`` gains.

    Raises:
        InputError: not of that form.
    """
    table: dict[str, Any] = {"kind": kind}
    keys.apply(table, gains, "--gain")
    return Component.model_validate(table)


def to_toml(scenario: Scenario) -> str:
    """Return the scenario as TOML with every default written out."""
    table: str = tomli_w.dumps(plain(_without_none(scenario.model_dump(mode="python"))))
    return table


def _read(path: Path, upon: tuple[Path, ...]) -> dict[str, Any]:
    """Return the file's table merged over its base's; ``upon`` are the files based on it."""
    try:
        table = tomllib.loads(path.read_text())
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: {error}") from None
    if not table.keys() & {"base", *Scenario.model_fields}:
        have = ", ".join(table) or "nothing"
        raise InputError(f"{path} is not a scenario: it has {have}, but no duration or law")
    table.setdefault("name", path.stem)
    if "base" not in table:
        return table
    base, upon = table.pop("base"), (*upon, path.resolve())
    if not isinstance(base, str):
        raise InputError(f"{path}: base: got {base!r}, should be a scenario's name or a path")
    try:
        below = _find(str(path.parent / base) if _is_path(base) else base)
    except InputError as error:
        raise InputError(f"{path}: base: {error}") from None
    if below.resolve() in upon:
        raise InputError(f"{path}: base: {base!r} is based on this file itself")
    return _merged(_read(below, upon), table)


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


def _find(scenario: str) -> Path:
    path = Path(scenario)
    if scenario in scenario_names():
        return Path(str(resources.files("mjspace.scenarios") / f"{scenario}.toml"))
    if path.is_dir():
        raise InputError(f"{scenario} is a folder: give a scenario's name or its TOML file")
    if path.is_file() and path.suffix != ".toml":
        raise InputError(f"{scenario} is not a scenario, a TOML file: {_purpose(path)}")
    if _is_path(scenario):
        if not path.is_file():
            raise InputError(f"no scenario file {scenario}")
        return path
    near = difflib.get_close_matches(scenario, scenario_names(), n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise InputError(f"no scenario {scenario!r}: {hint}'mjspace list' shows them")


def _purpose(path: Path) -> str:
    """Return what a file that is no scenario is for."""
    return {
        ".mcap": "it is the log of a flight, for 'mjspace replay', 'info', 'plot' or 'render'",
        ".xml": "a model is checked by 'mjspace validate --model', and named in [plant] model",
        ".urdf": "a model is checked by 'mjspace validate --model', and named in [plant] model",
        ".py": f'a law in it is named in a scenario\'s [law], as kind = "{path.name}:Class"',
    }.get(path.suffix, "'mjspace list' shows those that come with mjspace")


def _related(one: str, other: str) -> bool:
    """Return whether one of the dotted keys is the other or lies under it."""
    return f"{one}.".startswith(f"{other}.") or f"{other}.".startswith(f"{one}.")


_SHOULD_BE = {
    "float_type": "a number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": "text",
    "list_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "finite_number": "finite",
}


def _explain(key: str, problem: Any) -> str:
    if problem["type"] == "extra_forbidden":
        *parents, last = problem["loc"]
        return f"{key}: no such key{nearest(str(last), _keys_at(parents))}"
    if problem["type"] == "missing":
        return f"{key}: missing"
    if problem["type"] == "value_error":
        text = str(problem["ctx"]["error"])
        within = re.match(r"\w+", text)
        inner = key and within and within[0] in _keys_at(list(problem["loc"]))
        return f"{key}{'.' if inner else ': '}{text}" if key else text
    message = problem["msg"].replace("Input should", "should").replace("List should", "should")
    if problem["type"] in _SHOULD_BE:
        message = f"should be {_SHOULD_BE[problem['type']]}"
    return f"{key}: got {problem['input']!r}, {message}"


def _keys_at(parents: list[Any]) -> list[str]:
    """Return the keys of the table at that place of the scenario."""
    if parents[:1] == ["sensors"] and len(parents) > 1:
        return list(dict.fromkeys(key for kind in kinds() for key in kind.model_fields))
    model: type[BaseModel] | None = Scenario
    for part in parents:
        if isinstance(part, int) or model is None:
            continue
        field = model.model_fields.get(part)
        model = None if field is None else next(tables_in(type_of(field)), None)
    return list(model.model_fields) if model is not None else []


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [_without_none(item) for item in value]
    return value
