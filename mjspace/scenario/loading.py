"""Loading scenarios: read the file, apply overrides, validate, say in one line what is wrong."""

import re
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, get_origin

import tomli_w
from pydantic import BaseModel, ValidationError

from mjspace.errors import InputError, nearest, shortened
from mjspace.scenario import files, satellite_file
from mjspace.scenario import overrides as keys
from mjspace.scenario.construct import plain
from mjspace.scenario.declared import tables_in, type_of
from mjspace.scenario.scenario import Component, Scenario
from mjspace.scenario.sensors import kinds


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
    table, path, origins = read(scenario, overrides)
    return validated(table, str(path), origins), path.parent


def read(
    scenario: str | Path, overrides: Iterable[str] = ()
) -> tuple[dict[str, Any], Path, dict[str, str]]:
    """Return the scenario's table with the overrides, unvalidated, its file, and what set each key.

    Raises:
        InputError: no such scenario, no TOML, an override that is none, or a file of two-line
            elements that has no such satellite.
    """
    path = files.find(str(scenario))
    table = files.read(path)
    origins = keys.apply(table, overrides)
    satellite_file.put_lines(table, path, origins)
    return table, path, origins


def validated(table: dict[str, Any], where: str, origins: Mapping[str, str] = {}) -> Scenario:
    """Return the scenario that a ``table`` holds as it was ``read``, as ``load`` does.

    Raises:
        InputError: one line with all that is wrong.
    """
    cut = {"cut_short": "duration" in origins}
    found = validate(table, where, origins, context=cut)
    for what, measured in (("checks", found.checks), ("metrics", found.metrics)):
        late = [one for one in measured if one.begins_too_late(found.duration)]
        if late:
            names = ", ".join(repr(one.name) for one in late)
            warnings.warn(
                f"{what} that begin after the flight's end, {found.duration:g} s, left out: "
                f"{names}",
                stacklevel=3,
            )
            kept = [one for one in measured if one not in late]
            found = found.model_copy(update={what: kept})
    if stale := found.environment.stale_orbit:
        warnings.warn(f"environment.orbit.tle: {stale}", stacklevel=3)
    return found


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
    return f"{key}: got {shortened(repr(problem['input']))}, {message}"


def _keys_at(parents: list[Any]) -> list[str]:
    """Return the keys of the table at that place of the scenario."""
    if parents[:1] == ["sensors"] and len(parents) > 1:
        return list(dict.fromkeys(key for kind in kinds() for key in kind.model_fields))
    model: type[BaseModel] | None = Scenario
    named = False  # whether the next is a name of the user's
    for part in parents:
        if isinstance(part, int) or model is None or named:
            named = False
            continue
        field = model.model_fields.get(part)
        kind = None if field is None else type_of(field)
        named = get_origin(kind) is dict
        model = next(tables_in(kind), None)
    return list(model.model_fields) if model is not None else []


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [_without_none(item) for item in value]
    return value
