"""Flights compiled and in Python, to be compared bit by bit and event by event."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from mjspace.contract import Event
from mjspace.errors import FlightError
from mjspace.scenario.loading import load
from mjspace.simulation import compiled_blocks
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import Start, first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.stepper import Stepper
from mjspace.vehicle.vehicle import UnphysicalInertiaWarning

SHORT_BLOCKS = [
    pytest.mark.usefixtures("short_blocks"),
    pytest.mark.filterwarnings(
        f"ignore::{UnphysicalInertiaWarning.__module__}.UnphysicalInertiaWarning"
    ),
]
"""Marks of a test module whose flights are of several blocks, some of them of papers' bodies."""


class Flown(NamedTuple):
    """A flight: rows by topic and field, events, what ended it, and what was compiled."""

    rows: dict[str, np.ndarray]
    events: list[Event]
    trouble: str
    compiled: str

    def bits(self, vehicle: Any = slice(None)) -> dict[str, bytes]:
        fields = {name: values for name, values in self.rows.items() if name != "time"}
        return {name: values[:, vehicle].tobytes() for name, values in fields.items()}

    @property
    def told(self) -> list[Event]:
        """The events in order of time, vehicle and text, as no block cuts them."""
        return sorted(self.events)


def assembly(name: str, *overrides: str, folder: Path | None = None) -> Assembly:
    scenario, beside = load(name, ["checks=[]", *overrides])
    return assemble(scenario, folder or beside)


def flown(
    built: Assembly,
    members: Sequence[int] = (0,),
    *,
    compiled: bool = True,
    start: Start | None = None,
    threads: int = 1,
    stop: Callable[[], bool] = lambda: False,
) -> Flown:
    made: list[Any] = []
    initialize = compiled_blocks.CompiledBlocks.__init__

    def initialized(self: Any, *arguments: Any) -> None:
        initialize(self, *arguments)
        self.on = self.on and compiled
        made.append(self)

    blocks, trouble = [], ""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiled_blocks.CompiledBlocks, "__init__", initialized)
        try:
            for block in fly(
                built, start or first_start(built, members), members, threads=threads, stop=stop
            ):
                blocks.append(block)
        except FlightError as error:
            trouble = str(error)
    rows = {
        f"{topic}.{field}": np.concatenate([block.rows[topic][field] for block in blocks])
        for topic, fields in blocks[0].rows.items()
        for field in fields
    }
    rows["time"] = np.concatenate([block.time for block in blocks])[:, None]
    return Flown(rows, [e for block in blocks for e in block.events], trouble, str(made[0]))


def assert_same(one: Flown, other: Flown) -> None:
    assert one.rows.keys() == other.rows.keys()
    for name, values in one.rows.items():
        assert values.shape == other.rows[name].shape, name
        assert values.tobytes() == other.rows[name].tobytes(), name
    assert one.told == other.told
    assert one.trouble == other.trouble


def one_of(start: Start, vehicle: int) -> Start:
    """Return one vehicle's part of a start."""

    def part(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        return {name: values[vehicle : vehicle + 1] for name, values in arrays.items()}

    law = start.law
    if law:
        law = type(law)(*(values[vehicle : vehicle + 1] for values in law))
    return dataclasses.replace(
        start,
        law=law,
        physics=start.physics[vehicle : vehicle + 1],
        sensors=part(start.sensors),
        actuators=part(start.actuators),
    )


def start_of_row(built: Assembly, flight: Flown, row: int) -> Start:
    """Return the state that a flight has logged in that row as a start."""
    logged: dict[str, dict[str, np.ndarray]] = {"sensor": {}, "actuator": {}, "law": {}}
    for topic, values in flight.rows.items():
        kind, _, field = topic.removeprefix("/state.").partition("_")
        if topic.startswith("/state.") and kind in logged:
            logged[kind][field] = values[row]
    reference = built.reference.at(np.zeros(1))
    law = built.law.reset(
        Stepper(built, first_start(built, [0])).sense(0).measurement,
        type(reference)(*(a[0] for a in reference)),
    )
    state = type(law)(*(logged["law"][field] for field in law._fields)) if law else ()
    physics = flight.rows["/state.physics"][row]
    return Start(row, physics, logged["sensor"], state, logged["actuator"])
