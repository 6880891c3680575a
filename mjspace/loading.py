"""Reading scenarios: find the file, apply overrides, validate, say in one line what is wrong."""

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import Any, get_args

import tomli_w
from pydantic import BaseModel, ValidationError

from mjspace.components import nearest, plain
from mjspace.errors import InputError
from mjspace.scenario import Component, Scenario


def scenario_names() -> list[str]:
    """Return the names of the scenarios that come with mjspace."""
    folder = resources.files("mjspace.scenarios")
    return sorted(p.name[:-5] for p in folder.iterdir() if p.name.endswith(".toml"))


def load(scenario: str | Path, overrides: Iterable[str] = ()) -> tuple[Scenario, Path]:
    """Return the scenario of that name or path, and the folder its own files are beside.

    A file may say ``base``: another scenario, by its name or by a path from the file's folder,
    whose tables it changes key by key. A table of another ``kind`` replaces the base's as a whole.
    ``overrides``, which come last, are ``key=value`` with a dotted key and a TOML value; a bare
    word is a string.

    Raises:
        InputError: no such scenario, no TOML, or a key that is wrong; one line.
    """
    path = _find(str(scenario))
    table = _read(path, ())
    origins = {}
    for override in overrides:
        origins[_override(table, override)] = f"--set {override}"
    return validate(table, str(path), origins), path.parent


def validate(table: dict[str, Any], where: str, origins: Mapping[str, str] = {}) -> Scenario:
    """Return the scenario that ``table`` holds.

    Raises:
        InputError: one line with the file (or the option that set the key), the key, what was found
            and what would be right.
    """
    try:
        return Scenario.model_validate(table)
    except ValidationError as error:
        problems = error.errors()
        first = problems[0]
        key = ".".join(str(part) for part in first["loc"])
        source = next((o for k, o in origins.items() if _related(k, key)), where)
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        raise InputError(f"{source}: {_explain(key, first)}{more}") from None


def component(kind: str, gains: Iterable[str]) -> Component:
    """Return a law or reference from its kind and ``key=value`` gains.

    Raises:
        InputError: not of that form.
    """
    table: dict[str, Any] = {"kind": kind}
    for gain in gains:
        _override(table, gain, "--gain")
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
    return scenario.endswith(".toml") or "/" in scenario


def _find(scenario: str) -> Path:
    if _is_path(scenario):
        if not Path(scenario).is_file():
            raise InputError(f"no scenario file {scenario}")
        return Path(scenario)
    if scenario not in scenario_names():
        near = difflib.get_close_matches(scenario, scenario_names(), n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise InputError(f"no scenario {scenario!r}: {hint}'mjspace list' shows them")
    return Path(str(resources.files("mjspace.scenarios") / f"{scenario}.toml"))


def _override(table: dict[str, Any], override: str, option: str = "--set") -> str:
    key, equals, text = override.partition("=")
    key = key.strip()
    if not equals or not key:
        raise InputError(f"{option} {override}: write key=value")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
    *parents, last = key.split(".")
    place: Any = table
    for part in parents:
        if isinstance(place, list) and part.isdigit() and int(part) < len(place):
            place = place[int(part)]
        elif isinstance(place, dict):
            place = place.setdefault(part, {})
        else:
            raise InputError(f"{option} {override}: {part!r} is not in a table")
    if isinstance(place, list) and last.isdigit() and int(last) < len(place):
        place[int(last)] = value
    elif isinstance(place, dict):
        place[last] = value
    else:
        raise InputError(f"{option} {override}: {last!r} is not in a table")
    return key


def _related(one: str, other: str) -> bool:
    """Return whether one of the dotted keys is the other or lies under it."""
    return f"{one}.".startswith(f"{other}.") or f"{other}.".startswith(f"{one}.")


def _explain(key: str, problem: Any) -> str:
    found = problem.get("input")
    if problem["type"] == "extra_forbidden":
        *parents, last = problem["loc"]
        return f"{key}: no such key{nearest(str(last), _keys_at(parents))}"
    if problem["type"] == "missing":
        return f"{key}: missing"
    if problem["type"] == "value_error":
        return f"{key}: {problem['ctx']['error']}" if key else str(problem["ctx"]["error"])
    message = problem["msg"].replace("Input should", "should").replace("List should", "should")
    return f"{key}: got {found!r}, {message}"


def _keys_at(parents: list[Any]) -> list[str]:
    """Return the keys of the table at that place of the scenario."""
    model: type[BaseModel] | None = Scenario
    for part in parents:
        if isinstance(part, int) or model is None:
            continue
        model = (
            _model_in(model.model_fields[part].annotation) if part in model.model_fields else None
        )
    return list(model.model_fields) if model is not None else []


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((m for a in get_args(annotation) if (m := _model_in(a)) is not None), None)


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [_without_none(item) for item in value]
    return value
