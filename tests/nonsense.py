"""Values that mean nothing to a number, and everything in a scenario that holds one."""

import dataclasses
import importlib
import inspect
import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
from orbit_samples import ephemeris
from pydantic import BaseModel, RootModel

from mjspace.scenario import sensors
from mjspace.scenario.declared import tables_in, type_of
from mjspace.scenario.files import scenario_names
from mjspace.scenario.loading import load
from mjspace.scenario.scenario import Component, Scenario
from mjspace.scenario.trust import controllers

SCALARS = (math.nan, math.inf, -math.inf, -1.0, 0.0, 400.0, True, "7", "x")


@cache
def scenarios() -> list[Scenario]:
    """Return every scenario that comes with mjspace."""
    return [load(name)[0] for name in scenario_names()]


_RCS = load("rcs-coarse-fine")[0].plant.rcs
assert _RCS is not None
FACTS: dict[str, Any] = {
    "inertia": np.diag([10.0, 11.0, 12.0]),
    "wheel_axes": np.eye(3),
    "wheel_inertia": np.full(3, 0.1),
    "control_period": 1e-4,
    "inner_period": 1e-4,
    "gimbal_axes": np.eye(3),
    "gimbal_inertia": np.full(3, 0.2),
    "spin_axes": np.roll(np.eye(3), 1, axis=0),
    "link_length": np.array([1.2, 1.0]),
    "link_mass": np.array([6.0, 4.0]),
    "link_inertia": np.array([0.7, 0.3]),
    "thruster_positions": np.array(_RCS.positions),
    "thruster_directions": np.array(_RCS.unit_directions),
    "thruster_force": _RCS.of_each("thrust"),
    "ephemeris": ephemeris("inclined"),
}
DOUBLE_GIMBALS = {
    "gimbal_axes": [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]] * 3,
    "spin_axes": [[0.0, 0.0, 1.0]] * 3,
}
"""In place of the facts, for laws of two gimbals a wheel."""
UNFLOWN = {
    "targets:SpacecraftTarget": {
        "target": {"kind": "relative_orbit:RelativeOrbit", "orbit_rate": 1e-3, "height": 9.0}
    }
}
"""Gains of those that no scenario flies and that have others than numbers."""


def kinds() -> Iterator[tuple[str, type]]:
    """Yield every law and reference that comes with mjspace, as a scenario names it."""
    for short, full in sorted(controllers().items()):
        module = importlib.import_module(full)
        for name, kind in vars(module).items():
            own = inspect.isclass(kind) and kind.__module__ == module.__name__
            flies = own and (hasattr(kind, "batched") or hasattr(kind, "at"))
            public = dataclasses.is_dataclass(kind) and not name.startswith("_")
            if flies and public and not inspect.isabstract(kind):
                yield f"{short}:{name}", kind


def gains_of(name: str, kind: type) -> dict[str, Any]:
    """Return gains that fit: those of a scenario that flies it, else made from the declaration."""
    for scenario in scenarios():
        for component in (scenario.law, scenario.reference, scenario.estimator):
            if component is not None and component.kind == name:
                own = DOUBLE_GIMBALS if name.startswith("attitude_momentum:") else {}
                return component.gains | own
    if name in UNFLOWN:
        return dict(UNFLOWN[name])
    required = [
        field
        for field in dataclasses.fields(kind)
        if field.default is dataclasses.MISSING
        and field.default_factory is dataclasses.MISSING
        and field.name not in FACTS
    ]
    return {field.name: _fit(field.metadata) for field in required}


def _fit(metadata: Any) -> Any:
    shape = [size if isinstance(size, int) else 4 for size in metadata["shape"]]
    if metadata["form"] == "increasing":
        return list(np.arange(4.0))
    value = np.zeros(shape) if metadata["form"] else np.ones(shape)
    if metadata["form"]:
        value[..., 0] = 1.0
    return value.tolist()


def spoilt(value: Any) -> Iterator[Any]:
    """Yield what a number, or an array of them, may be replaced by that it should not be."""
    yield from ([], [[[1.0]]], {})
    for scalar in SCALARS:
        yield with_first(value, scalar)
    if isinstance(value, list):
        yield from (1.0, value[:-1], [*value, *value[:1]], [value])


def with_first(value: Any, scalar: Any) -> Any:
    """Return nested lists with their first number replaced."""
    if isinstance(value, list) and value:
        return [with_first(value[0], scalar), *value[1:]]
    return scalar


def first(value: Any) -> Any:
    """Return the first number of nested lists."""
    while isinstance(value, list) and value:
        value = value[0]
    return value


def tables() -> dict[type[BaseModel], list[dict[str, Any]]]:
    """Return each table of a scenario with examples of it, from the scenarios and by default."""
    found: dict[type[BaseModel], list[dict[str, Any]]] = {}
    for kind in (*_kinds_in(Scenario), *sensors.kinds()):
        try:
            found[kind] = [kind().model_dump(mode="python")]
        except ValueError:
            found[kind] = []
    for scenario in scenarios():
        for model in _models_in(scenario):
            dump = {k: v for k, v in model.model_dump(mode="python").items() if v is not None}
            found[type(model)].append(dump)
    return found


def _kinds_in(annotation: Any) -> Iterator[type[BaseModel]]:
    for table in tables_in(annotation):
        if table is not Component:
            yield table
            for field in table.model_fields.values():
                yield from _kinds_in(type_of(field))


def _models_in(value: Any) -> Iterator[BaseModel]:
    if isinstance(value, Component):
        return
    if isinstance(value, RootModel):
        yield from _models_in(value.root)
    elif isinstance(value, BaseModel):
        yield value
        for name in type(value).model_fields:
            yield from _models_in(getattr(value, name))
    elif isinstance(value, list | dict):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _models_in(item)
