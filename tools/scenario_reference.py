"""Write docs/scenario.md from the typed scenario, so that the page cannot say anything else."""

import inspect
from collections.abc import Iterator
from dataclasses import MISSING, Field, fields, is_dataclass
from datetime import datetime
from importlib import import_module
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import MaxLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from mjspace.contract import Ephemeris
from mjspace.scenario.construct import table_of
from mjspace.scenario.declared import DeclaredIn, tables_in, type_of
from mjspace.scenario.docstrings import docstrings
from mjspace.scenario.fields import OneOrEach, Si
from mjspace.scenario.scenario import Scenario
from mjspace.scenario.sensors import KINDS, kinds
from mjspace.scenario.trust import controllers

PAGE = Path(__file__).parents[1] / "docs/scenario.md"
HEAD = """# The scenario reference

A scenario is a TOML file. This page is written by `python tools/scenario_reference.py` from the
typed model that reads it. Unknown keys, wrong units and wrong shapes are refused with the file, the
key and what would be right, and so is a number that is not finite or outside the range beside it.
Numbers are SI; where a unit is stated, a string with a unit does too: `"30 deg/s"`, `"5 mN m"`, `"2
min"`. `mjspace info NAME` shows a scenario with every default written out, and `--set key=value`
overrides any key.

## On top of another

`base = "dgvscmg-tracking"` begins with another scenario, one that comes with mjspace or a file by
its path from this file's folder (`base = "../calm.toml"`), and the rest of the file is what
differs. Tables merge key by key; numbers and lists, `[[checks]]` among them, replace the base's. A
`[law]`, `[reference]` or `[estimator]` of another `kind` starts afresh, with none of the base's
gains, and so it does under `--set law.kind=...`, in whatever order the overrides stand. A base may
have a base; `--set` comes last. A `duration` that is set on the command line leaves out the checks
that begin after the flight's end, with a warning. Files that a base names are looked up from this
file's folder, and those of mjspace's own scenarios beside them. What is logged is the whole,
without `base`.
"""


def page() -> str:
    """Return the page."""
    lines = [HEAD]
    for path, table in _tables(Scenario, ""):
        lines += [f"## {f'`{path}`' if path else 'At the top'}", "", _line(table.__doc__ or ""), ""]
        lines += ["| key | value | default | what |", "|---|---|---|---|"]
        for key, field in table.model_fields.items():
            inner = _table_in(type_of(field))
            what = _line(_described(table, key) or (inner.__doc__ if inner else "") or "")
            lines.append(f"| `{key}` | {_value(field)} | {_default(field)} | {what} |")
        lines.append("")
    return "\n".join(lines + _laws())


def _described(table: type[BaseModel], key: str) -> str:
    """Return the key's description, which a class may leave to the one that it is based on."""
    bases = [base for base in table.__mro__ if issubclass(base, BaseModel)]
    stated = table.model_fields[key].description
    return stated or next((text for base in bases if (text := docstrings(base).get(key))), "")


def _laws() -> list[str]:
    """Return what may stand behind ``kind``, with its gains."""
    lines = ["## Laws, references and estimators that come with mjspace", ""]
    lines += ["| kind | gains (unit, range): default |", "|---|---|"]
    for short, full in sorted(controllers().items()):
        module = import_module(full)
        for name, kind in vars(module).items():
            flies = hasattr(kind, "batched") or hasattr(kind, "at")
            own = is_dataclass(kind) and kind.__module__ == module.__name__
            if own and flies and not inspect.isabstract(kind):
                gains = [_gain(f) for f in fields(kind) if f.type is not Ephemeris]
                lines.append(f"| `{short}:{name}` | {', '.join(gains)} |")
    closing = """
A gain without a default must be set, but for `inertia`, `wheel_axes`, `wheel_inertia`,
`control_period` and `inner_period` (the integration step): left out, they are those of the
vehicle and the scenario as flown. Those that point by the orbit are handed the ephemeris of the
scenario's environment: see [pointing](references.md). Every number of a gain is finite but where
`inf`, no limit, is in its range. Arrays may come from a CSV file: `file = "turn.csv"`, with a
header that names the gains
(`time,attitude0,attitude1,attitude2,attitude3`).

A law in a file of your own may import modules beside it, at the top of the file, and read data
files beside it that it lists: `DATA_FILES = ("table.csv",)`, found from `Path(__file__).parent`.
They all go into the log, from which the flight is replayed without the folder.

A law in a shared library has the keys `state` and `signals`, one in another process `timeout`: see
[flight software](flight_software.md)."""
    return [*lines, closing, ""]


def _gain(field: Field[Any]) -> str:
    if (table := table_of(field.type)) is not None:
        return f"`{field.name}` (table: {', '.join(map(_gain, fields(table)))})"
    unit = field.metadata.get("unit", "")
    words = ["any unit" if unit is None else unit]
    words += [field.metadata.get(key, "") for key in ("range", "form")]
    words += ["one for all or each"] * field.metadata.get("one_for_all", False)
    stated = ", ".join(str(word) for word in words if str(word)).replace("|", "\\|")
    unit = f" ({stated})" if stated else ""
    if field.default_factory is not MISSING:
        return f"`{field.name}`{unit}: {field.default_factory().tolist()}"
    default = '""' if field.default == "" else field.default
    return f"`{field.name}`{unit}" + ("" if default is MISSING else f": {default}")


def _tables(table: type[BaseModel], path: str) -> Iterator[tuple[str, type[BaseModel]]]:
    """Yield each table of a scenario with its TOML heading, in the order of the keys."""
    yield path, table
    for key, field in table.model_fields.items():
        inner = _table_in(type_of(field))
        if table is Scenario and key == "sensors":
            for quantity, kind in zip(KINDS, kinds(), strict=True):
                yield f'[sensors.<name>] with measures = "{quantity}"', kind
        elif inner is not None:
            name = f"{path.strip('[]')}.{key}".lstrip(".")
            many = get_origin(type_of(field))
            heading = {list: f"[[{name}]]", dict: f"[{name}.<name>]"}.get(many, f"[{name}]")
            yield from _tables(inner, heading)


def _table_in(kind: Any) -> type[BaseModel] | None:
    return next(tables_in(kind), None)


def _value(field: FieldInfo) -> str:
    """Return what a key holds, as a person says it."""
    annotation = type_of(field)
    if field is Scenario.model_fields["sensors"]:
        return "tables by name"
    if _table_in(annotation):
        many = {list: "tables", dict: "tables by name"}
        return many.get(get_origin(annotation), "table")
    marks = [mark for mark in field.metadata if not isinstance(mark, DeclaredIn)]
    return _kind(Annotated[annotation, *marks] if marks else annotation)


def _kind(annotation: Any) -> str:
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return " or ".join(f'`"{choice}"`' for choice in parts)
    if origin is UnionType or origin is Union:
        return " or ".join(_kind(part) for part in parts if part is not NoneType)
    if origin is dict:
        return f"table of {_kind(parts[1])}s by name"
    for each in (mark for mark in parts[1:] if isinstance(mark, OneOrEach)):
        units = [mark for mark in parts[1:] if isinstance(mark, Si)]
        one = _kind(Annotated[each.kind, *units] if units else each.kind)
        return f"{one}, or a list with one for each"
    sizes, unit, scalar = _shape(annotation)
    words = {float: "number", int: "whole number", str: "text", bool: "true or false"}
    word = (words | {datetime: "date and time"})[scalar]
    count = f"{' x '.join(sizes)} {word}s" if sizes else word
    limits = _limits(annotation)
    return f"{count} [{unit}]{limits}" if unit else f"{count}{limits}"


def _limits(annotation: Any) -> str:
    """Return the range of the numbers inside, as it is printed; empty where it has no end."""
    if get_origin(annotation) not in (Annotated, list):
        return ""
    first, *marks = get_args(annotation)
    ends = []
    for mark in marks:
        for limit in mark.metadata if isinstance(mark, FieldInfo) else [mark]:
            for sign, name in ((">", "gt"), (">=", "ge"), ("<", "lt"), ("<=", "le")):
                if hasattr(limit, name):
                    ends.append(f"{sign} {getattr(limit, name):.4g}")
    inner = _limits(first)
    return inner + (f" {', '.join(ends)}" if ends else "")


def _shape(annotation: Any) -> tuple[list[str], str, type]:
    """Return the sizes ('n' where free) of nested lists, the unit, and the type inside."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        sizes, unit, scalar = _shape(parts[0])
        for mark in parts[1:]:
            if isinstance(mark, Si) and mark.si:
                unit = mark.si
            limits = mark.metadata if isinstance(mark, FieldInfo) else [mark]
            for limit in limits:
                if isinstance(limit, MaxLen):
                    sizes = [str(limit.max_length), *sizes[1:]]
        return sizes, unit, scalar
    if origin is list:
        sizes, unit, scalar = _shape(parts[0])
        return ["n", *sizes], unit, scalar
    return [], "", annotation


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "**required**"
    default = field.get_default(call_default_factory=True)
    if default is None or default == "" or isinstance(default, BaseModel):
        return ""
    return f"`{str(default).lower() if isinstance(default, bool) else default}`"


def _line(text: str) -> str:
    return " ".join(text.split()).replace("``", "`").replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(page())
