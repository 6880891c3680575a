"""No law, no reference and no table takes a number that means nothing to it."""

import dataclasses
import inspect
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nonsense import FACTS, first, gains_of, kinds, spoilt, tables
from pydantic import BaseModel, ValidationError

from mjspace.ranges import Range
from mjspace.scenario.construct import construct
from mjspace.scenario.scenario import Component
from mjspace.scenario.trust import Trust

KINDS = dict(kinds())
TABLES = tables()
NO_CHOICES: tuple[Any, ...] = (math.nan, -1, 7.5, [], {}, "30 N m", "nonsense")


def documented(limits: str, value: float) -> bool:
    """Return whether a range, as the scenario reference prints it, has ``value`` in it."""
    if not math.isfinite(value):
        return f"or {value}" in limits
    if "whole" in limits and value != round(value):
        return False
    inside = {
        ">": value.__gt__, ">=": value.__ge__, "<": value.__lt__, "<=": value.__le__
    }  # fmt: skip
    return all(inside[sign](float(end)) for sign, end in re.findall(r"([<>]=?) ([^ ,]+)", limits))


@pytest.mark.parametrize("name", KINDS)
def test_gains_take_what_is_declared_and_nothing_else(name: str) -> None:
    kind, gains = KINDS[name], gains_of(name, KINDS[name])

    def build(**changed: Any) -> Any:
        return construct(Component(kind=name, **gains | changed), kind, FACTS, Trust(Path()))[0]

    whole = build()
    for field in dataclasses.fields(kind):
        declared = field.metadata
        if "unit" not in declared:
            continue
        value = np.asarray(getattr(whole, field.name)).tolist()
        for bad in spoilt(value):
            number = first(bad)
            is_number = isinstance(number, float) and np.shape(bad) == np.shape(value)
            admitted = is_number and documented(str(declared["range"]), number)
            open_ended = isinstance(bad, list) and None in declared["shape"][:1]
            named = any(isinstance(size, str) for size in declared["shape"][:1])
            try:
                build(**{field.name: bad})
            except ValueError as error:
                message = str(error)
                assert "\n" not in message, message
                # What the declaration admits may be at odds with another gain, or be of no form.
                assert admitted or message.startswith(field.name) or named, message
            else:
                assert admitted or open_ended or named, (field.name, bad)


@pytest.mark.parametrize("name", KINDS)
def test_a_law_that_is_constructed_directly_takes_no_nan(name: str) -> None:
    kind, gains = KINDS[name], gains_of(name, KINDS[name])
    whole, _ = construct(Component(kind=name, **gains), kind, FACTS, Trust(Path()))
    for field in dataclasses.fields(kind):
        if "unit" in field.metadata:
            spoiled = np.full(np.shape(getattr(whole, field.name)), np.nan)
            if not spoiled.size:
                continue
            with pytest.raises(ValueError, match=rf"^{field.name}.*number"):
                dataclasses.replace(whole, **{field.name: spoiled})


@pytest.mark.parametrize("name", KINDS)
def test_choices_and_switches_take_no_nonsense(name: str) -> None:
    kind, gains = KINDS[name], gains_of(name, KINDS[name])
    for field in dataclasses.fields(kind):
        if "unit" in field.metadata:
            continue
        for bad in NO_CHOICES:
            with pytest.raises(ValueError, match=field.name) as refused:
                construct(
                    Component(kind=name, **gains | {field.name: bad}), kind, FACTS, Trust(Path())
                )
            assert "\n" not in str(refused.value)


def scalar_schema(schema: dict[str, Any]) -> dict[str, Any]:
    """Return what the schema says of a key's numbers, whether single, in lists or optional."""
    while True:
        if "anyOf" in schema:
            schema = next(s for s in schema["anyOf"] if s.get("type") != "null")
        elif schema.get("type") == "array":
            schema = schema["items"]
        else:
            return schema


def _is_open(schema: dict[str, Any], value: Any) -> bool:
    """Return whether the value may be a list of any length, or a number beside such a list."""
    if schema.get("type") == "number":
        return isinstance(value, float) and math.isfinite(value)
    return isinstance(value, list) and schema.get("type") == "array" and "maxItems" not in schema


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.__name__)
def test_tables_take_what_their_schema_says_and_nothing_else(table: type[BaseModel]) -> None:
    properties = table.model_json_schema()["properties"]
    for key, whole in properties.items():
        schema = scalar_schema(whole)
        if schema.get("type") not in ("number", "integer", "boolean"):
            continue
        example = next((e for e in TABLES[table] if e.get(key) is not None), None)
        if example is None:
            example = next(iter(TABLES[table]), None)
        if example is None:
            pytest.skip("no scenario has one")
        value = example.get(key, 1.0)
        for bad in spoilt(value):
            number = first(bad)
            right_shape = np.shape(bad) == np.shape(value) and bad != {}
            admitted = right_shape and fits(schema, number)
            free = "array" in str(whole) and any(
                _is_open(part, bad) for part in whole.get("anyOf", [whole])
            )
            try:
                table.model_validate({**example, key: bad})
            except ValidationError:
                continue
            else:
                assert admitted or free, (key, bad)


def fits(schema: dict[str, Any], value: Any) -> bool:
    if schema["type"] == "boolean":
        return isinstance(value, bool)
    if isinstance(value, bool | str) or not isinstance(value, int | float):
        return False
    return (
        math.isfinite(value)
        and value > schema.get("exclusiveMinimum", -math.inf)
        and value >= schema.get("minimum", -math.inf)
        and value < schema.get("exclusiveMaximum", math.inf)
        and value <= schema.get("maximum", math.inf)
        and (schema["type"] == "number" or value == round(value))
    )


def test_a_range_as_printed_is_the_range() -> None:
    assert str(Range(above=0.0)) == "> 0"
    assert str(Range(at_least=0.0, below=1.0)) == ">= 0, < 1"
    assert str(Range(above=0.0, at_most=math.inf)) == "> 0 or inf"
    assert str(Range(at_least=-math.inf)) == "or -inf"
    assert str(Range(at_least=1, whole=True)) == "whole, >= 1"


def test_what_is_searched_is_all_there_is() -> None:
    assert len(KINDS) >= 35
    assert len(TABLES) >= 30
    assert sum("unit" in f.metadata for k in KINDS.values() for f in dataclasses.fields(k)) > 250
    assert all(inspect.isclass(kind) for kind in KINDS.values())
