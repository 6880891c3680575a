"""Construct a law or a reference from its name and gains: find the class, check, convert."""

import dataclasses
import inspect
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Literal, get_args, get_origin

import numpy as np

from mjspace.errors import failure, nearest, shortened
from mjspace.ranges import numbers, refuse_unfit
from mjspace.scenario.gain_tables import gains_in
from mjspace.scenario.scenario import Component
from mjspace.scenario.trust import Trust
from mjspace.units import quantity_in, to_si


def construct(
    component: Component, kind: type, facts: Mapping[str, Any], trust: Trust
) -> tuple[Any, Component]:
    """Return the object of class ``kind`` with the component's gains, and the component as flown.

    A parameter that the table leaves out is taken from ``facts`` where they hold its name (the
    vehicle's properties), else from its default; the component as flown has all written out, but
    for facts that are objects, as the ephemeris is.
    ``file`` gives the rows of a table read from a CSV file with a header of parameter names, or
    the arrays of an .npz. A table in a gain that has a ``kind`` is constructed in the same way, and
    so is one for a parameter that is annotated with a dataclass, or a list of it.

    Raises:
        ValueError: an unknown, missing or unfit gain, with its name and what would be right.
    """
    gains = component.gains
    if "file" in gains:
        file = gains.pop("file")
        if not isinstance(file, str):
            raise ValueError(f"file: got {shortened(repr(file))}, should be text")
        read = gains_in(trust.file(file))
        if both := sorted(read.keys() & gains.keys()):
            raise ValueError(f"{both[0]}: stands both here and in the file: leave one out")
        gains |= read
    values, written = _tables_in(kind, gains, facts, trust)
    built, flown = _build(kind, component.kind, values, written, facts)
    return built, Component(kind=component.kind, **flown)


def _build(
    kind: type,
    name_of_kind: str,
    gains: Mapping[str, Any],
    written: Mapping[str, Any],
    facts: Mapping[str, Any],
) -> tuple[Any, dict[str, Any]]:
    """Return the object of class ``kind`` and its gains as flown.

    Of the tables in ``gains``, which are constructed already, ``written`` has those as flown.
    """
    parameters = _parameters(kind)
    for name in gains:
        if name not in parameters:
            raise ValueError(f"{name}: {name_of_kind} has no such key{nearest(name, parameters)}")
        if _is_object(facts.get(name)):
            raise ValueError(f"{name}: it is that of the scenario's environment: leave it out")
    values = {name: facts[name] for name in parameters if name in facts} | dict(gains)
    missing = [
        name
        for name, parameter in parameters.items()
        if parameter.default is parameter.empty and name not in values
    ]
    if missing:
        raise ValueError(f"{missing[0]}: missing, and {name_of_kind} has no default for it")
    declared = {f.name: f.metadata for f in dataclasses.fields(kind)} if _is_data(kind) else {}
    for name, value in values.items():
        if "unit" in declared.get(name, {}):
            values[name] = _in_si(name, value, declared[name])
        else:
            _refuse_unlike(name, value, parameters[name].annotation, name_of_kind)
    refuse_unfit(values, declared)
    try:
        built = kind(**values)
    except ValueError:
        raise
    except BaseException as error:
        raise ValueError(str(failure("it", error))) from error
    flown = {
        name: plain(getattr(built, name, values.get(name)))
        for name in parameters
        if not _is_object(facts.get(name))
    }
    return built, flown | dict(written)


def _is_object(fact: Any) -> bool:
    """Tell whether a fact has methods, and no numbers that a scenario could hold."""
    return fact is not None and np.asarray(fact).dtype == object


def _tables_in(
    kind: type, gains: Mapping[str, Any], facts: Mapping[str, Any], trust: Trust, at: str = ""
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the gains with the tables in them constructed, and those gains as flown.

    ``at`` comes before their keys in messages.
    """
    parameters = _parameters(kind)
    values, written = dict(gains), {}
    for name, gain in gains.items():
        table = table_of(parameters[name].annotation) if name in parameters else None
        if table is not None or _has_kind(gain):
            values[name], written[name] = _within(f"{at}{name}", gain, table, facts, trust)
    return values, written


def _has_kind(value: Any) -> bool:
    """Return whether the gain is, or holds, a table with a ``kind``."""
    if isinstance(value, Mapping):
        return "kind" in value or any(map(_has_kind, value.values()))
    return isinstance(value, list) and any(map(_has_kind, value))


def table_of(annotation: Any) -> type | None:
    """Return the dataclass of which a parameter with that annotation takes a table, or several."""
    if isinstance(annotation, type) and _is_data(annotation):
        return annotation
    return next(filter(None, map(table_of, get_args(annotation))), None)


def _within(
    key: str, value: Any, table: type | None, facts: Mapping[str, Any], trust: Trust
) -> tuple[Any, Any]:
    """Return the gain with every table in it constructed, and as flown.

    A table without a ``kind`` is one of the dataclass ``table``, if any.
    """
    if isinstance(value, list):
        pairs = [_within(f"{key}.{n}", item, table, facts, trust) for n, item in enumerate(value)]
        return [built for built, _ in pairs], [flown for _, flown in pairs]
    if not isinstance(value, Mapping):
        return value, value
    if "kind" not in value:
        if table is not None:
            values, written = _tables_in(table, value, facts, trust, f"{key}.")
            with _at(key):
                return _build(table, table.__name__, values, written, facts)
        items = {n: _within(f"{key}.{n}", v, None, facts, trust) for n, v in value.items()}
        return {n: built for n, (built, _) in items.items()}, {
            n: flown for n, (_, flown) in items.items()
        }
    if not isinstance(value["kind"], str):
        raise ValueError(f"{key}.kind: got {value['kind']!r}, should be text")
    inner = Component.model_validate(value)
    with _at(key):
        if inner.kind.partition(":")[0].endswith(".py"):
            raise ValueError(
                f"{inner.kind}: a law within another comes from a module, as the log "
                "keeps the text of one file alone"
            )
        built, flown = construct(inner, trust.load_class(inner.kind), facts, trust)
    return built, {"kind": flown.kind, **flown.gains}


@contextmanager
def _at(key: str) -> Iterator[None]:
    """Put the ``key`` before the message of a ValueError."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from error


def plain(value: Any) -> Any:
    """Return ``value`` with its arrays as lists, as TOML can hold it."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def _is_data(kind: type) -> bool:
    return dataclasses.is_dataclass(kind)


def _parameters(kind: type) -> Mapping[str, inspect.Parameter]:
    """Return the parameters of ``kind``, their annotations as types where those are known."""
    try:
        return inspect.signature(kind, eval_str=True).parameters
    except NameError:
        return inspect.signature(kind).parameters


def _in_si(name: str, value: Any, declared: Mapping[str, Any]) -> Any:
    """Return a declared gain in SI: an array, or the one number that it should be."""
    try:
        array = numbers(to_si(value, declared["unit"]))
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    if array.shape or (declared["shape"] and not declared["one_for_all"]):
        return array
    number = float(array)
    return int(number) if declared["range"].whole and number.is_integer() else number


def _refuse_unlike(name: str, value: Any, annotation: Any, kind: str) -> None:
    """Refuse a value that does not fit the annotation of a gain without a declared unit."""
    quantity = None if _takes_text(annotation) else quantity_in(value)
    if quantity is not None:
        place, text = quantity
        unit = text.strip().partition(" ")[2]
        cure = "write a number in SI"
        if not place:
            cure += (
                f", or declare {name}: float = gain({unit!r}) in {kind}, a dataclass "
                "(mjspace.contract.gain)"
            )
        raise ValueError(f"{name}{place}: got {text!r}, but {kind} declares no unit for it: {cure}")
    if get_origin(annotation) is Literal:
        if value not in get_args(annotation):
            have = ", ".join(map(repr, get_args(annotation)))
            raise ValueError(f"{name}: got {value!r}, should be one of {have}")
        return
    word = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}
    if annotation not in word:
        return
    kinds = (int, float) if annotation is float else annotation
    right = isinstance(value, kinds) and (annotation is bool or not isinstance(value, bool))
    if not right or value != value:  # nan is not equal to itself
        raise ValueError(f"{name}: got {value!r}, should be {word[annotation]}")


def _takes_text(annotation: Any) -> bool:
    """Return whether a parameter with that annotation may be text, or hold text."""
    if annotation in (str, "str") or get_origin(annotation) is Literal:
        return True
    inside = get_args(annotation)
    if issubclass(get_origin(annotation) or object, Mapping):
        inside = inside[1:]
    return any(map(_takes_text, inside))
