"""What passes between a scenario's vehicle and flight software: arrays by name, of one vehicle."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from mjspace import contract
from mjspace.contract import REPORTED_BY_PLANT, Array, Measurement, Reference, Trajectory
from mjspace.scenario.docstrings import docstrings
from mjspace.simulation.assembly import Assembly, facts_of
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.stepper import Stepper
from mjspace.simulation.user_code import reference_at
from mjspace.units import Unit, units_of
from mjspace.vehicle.vehicle import Vehicle

_COMMANDS = (
    contract.TorqueCommand,
    contract.VoltageCommand,
    contract.GimbalRateCommand,
    contract.ThrustCommand,
    contract.PulseCommand,
)
_PERIODS = {
    "control_period": "Time from one control instant to the next [s].",
    "inner_period": "The integration step [s].",
}


class Field(NamedTuple):
    """An array of float64 that passes to flight software or back."""

    shape: tuple[int, ...] = ()
    unit: str = ""
    """SI."""
    about: str = ""
    """A sentence with its frame."""
    measures: str = ""
    """Of a sensor's report: the quantity."""


Fields = Mapping[str, Field]
"""By name, in their order."""


@dataclass(frozen=True)
class Interface:
    """What flight software of a scenario is told, and what it has to command."""

    vehicle: Fields
    """What is constant in a flight: properties of the vehicle, and periods."""
    measurement: Fields
    reference: Fields
    command: Fields
    facts: Mapping[str, Any]
    """The values of ``vehicle``."""


def interface_of(assembly: Assembly) -> Interface:
    """Return the interface of flight software for the scenario that was assembled."""
    facts = {
        name: np.asarray(value, dtype=float)
        for name, value in facts_of(assembly.vehicle, assembly.scenario).items()
    }
    about = docstrings(Vehicle) | _PERIODS
    vehicle = {
        name: Field(value.shape, _unit_in(about.get(name, "")), _sentence(about.get(name, "")))
        for name, value in facts.items()
    }
    return Interface(vehicle, _measured(assembly), _desired(assembly), _commanded(assembly), facts)


def _measured(assembly: Assembly) -> dict[str, Field]:
    """Return what is measured: the sensors, in the scenario's order, and what the plant reports."""
    measurement = Stepper(assembly, first_start(assembly, [0])).sense(0).measurement
    units, about = units_of(Measurement), docstrings(Measurement)
    of_actuators = assembly.actuators.units["/measurement"]
    of_model = {own.field: own.unit for own in assembly.vehicle.sensors}
    found = {}
    for name in dict.fromkeys([*assembly.scenario.sensors, *REPORTED_BY_PLANT]):
        sensor = assembly.scenario.sensors.get(name)
        quantity = name if sensor is None else sensor.quantity(name)
        unit = of_actuators.get(name, "") if sensor is None else sensor.unit
        unit = of_model.get(quantity, unit)
        found[name] = Field(
            getattr(measurement, name).shape[1:],
            units[quantity].si if quantity in units else unit,
            _sentence(about.get(quantity, quantity.replace("_", " "))),
            quantity,
        )
        valid = f"{name}_valid"
        if valid in measurement._fields:
            found[valid] = Field((1,), "", f"1 where {name} is valid, else 0", valid)
    for own in assembly.vehicle.sensors:
        if own.field not in measurement._fields or own.field in found:
            continue  # a sensor of the scenario reports it
        about_it = f"The model's own sensor {own.name}, MuJoCo's {own.kind}"
        found[own.field] = Field((own.size,), own.unit, about_it, own.field)
    return found


def _desired(assembly: Assembly) -> dict[str, Field]:
    """Return the fields of the reference."""
    desired = reference_at(assembly.reference, np.zeros(1))
    units = units_of(type(desired))
    about = docstrings(Trajectory) | docstrings(Reference)
    return {
        name: Field(
            np.shape(rows)[1:],
            units[name].si if name in units else "",
            _sentence(about.get(name, "")),
        )
        for name, rows in desired._asdict().items()
    }


def _commanded(assembly: Assembly) -> dict[str, Field]:
    """Return the fields that the actuators obey."""
    about = {name: text for kind in _COMMANDS for name, text in docstrings(kind).items()}
    return {
        name: Field(
            (size,) if isinstance(size, int) else size, unit, _sentence(about.get(name, ""))
        )
        for kind in assembly.actuators.kinds
        for name, (size, unit) in kind.takes.items()
    }


def named_tuple(name: str, fields: Fields) -> type:
    """Return the class of named tuples with these fields, which declares their units."""
    declared = [
        (field, Annotated[Array, Unit(about.unit)] if about.unit else Array)
        for field, about in fields.items()
    ]
    kind: Any = NamedTuple(name, declared)  # type: ignore[misc]
    return kind


def _sentence(text: str) -> str:
    """Return a description on one line, without the shape and the unit in it."""
    line = re.sub(r",? ?shape \([^)]*\)(?:: )?", "", " ".join(text.split()))
    return re.sub(r" ?\[[^]]*\]", "", line).strip(" .")


def _unit_in(text: str) -> str:
    """Return the unit that a description states, in brackets."""
    found = re.search(r"\[([^]]*)\]", text)
    return found[1] if found else ""
