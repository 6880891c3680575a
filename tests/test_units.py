"""Units: conversion to SI, the unit beside a field, the unit of a plot."""

import copy
import pickle
from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest

from mjspace.contract import Array, Measurement, Reference, TorqueCommand, Trajectory, Truth
from mjspace.log import topics
from mjspace.units import UNITS, Quantity, Unit, to_si, units_of


class Signals(NamedTuple):
    slip: Annotated[Array, "of the pads", Unit("m/s")]
    stiffness: Annotated[Array, Unit("N/m")]
    share: Array


def test_the_unit_of_a_field_is_read_from_its_annotation() -> None:
    assert units_of(Signals) == {"slip": Unit("m/s"), "stiffness": Unit("N/m")}
    assert units_of(TorqueCommand)["torque"].si == "N m"
    assert units_of(tuple) == {}


def test_annotations_that_cannot_be_evaluated_declare_nothing() -> None:
    class Local(NamedTuple):
        slip: "Nowhere"  # type: ignore[name-defined]  # noqa: F821

    assert units_of(Local) == {}


@pytest.mark.parametrize("kind", [Truth, Trajectory, Reference])
def test_a_field_of_one_name_has_one_unit_throughout_the_contract(kind: type) -> None:
    others = units_of(Measurement) | units_of(Trajectory)
    for name, unit in units_of(kind).items():
        assert others.get(name, unit) == unit


def test_the_units_of_the_contract_are_those_that_a_scenario_may_write() -> None:
    declared = {unit for fields in topics.units().values() for unit in fields.values()}
    known = {si for si, _ in UNITS.values()}
    assert {unit.si for unit in declared} <= known
    assert all(not unit.display or UNITS[unit.display][0] == unit.si for unit in declared)


@pytest.mark.parametrize(
    ("unit", "displayed"),
    [
        (Unit("rad"), ("deg", np.degrees(1.0))),
        (Unit("rad/s"), ("deg/s", np.degrees(1.0))),
        (Unit("rad/s^2"), ("deg/s^2", np.degrees(1.0))),
        (Unit("rad/s", display="rpm"), ("rpm", 30.0 / np.pi)),
        (Unit("N m"), ("N m", 1.0)),
        (Unit("N m, N m, N"), ("N m, N m, N", 1.0)),
        (Unit(""), ("", 1.0)),
    ],
)
def test_the_unit_of_a_plot(unit: Unit, displayed: tuple[str, float]) -> None:
    assert unit.displayed[0] == displayed[0]
    assert unit.displayed[1] == pytest.approx(displayed[1], rel=1e-15)


def test_the_laws_own_declarations_come_first() -> None:
    kinds = {"/law": {"": Signals}, "/state": {"law_": Signals}, "/command": {"": Signals}}
    found = topics.units(kinds)
    assert found["/law"] == units_of(Signals)
    assert found["/state"] == {"law_slip": Unit("m/s"), "law_stiffness": Unit("N/m")}
    assert found["/command"]["slip"] == Unit("m/s")
    assert found["/command"]["torque"] == Unit("N m")


def test_a_unit_outside_the_table_is_accepted_as_itself() -> None:
    assert to_si("0.5 1/s", "1/s") == 0.5
    assert to_si(["1 N m s^2", 2.0], "N m s^2") == [1.0, 2.0]
    with pytest.raises(ValueError, match="has the unit '1/min', should be 1/s"):
        to_si("0.5 1/min", "1/s")
    with pytest.raises(ValueError, match="has the unit 'deg', should be one of s, ms"):
        to_si("0.5 deg", "s")
    with pytest.raises(ValueError, match="got the text '3 deg', should be a plain number"):
        to_si("3 deg", "")


@pytest.mark.parametrize("again", [copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))])
def test_copies_and_pickles_of_a_quantity_keep_its_unit(again: Any) -> None:
    found = again(Quantity(0.5, "rad"))
    assert (found, type(found), found.unit) == (0.5, Quantity, "rad")
