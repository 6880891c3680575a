"""A flight's log: what describes the flight, and blocks of control periods."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.log import foxglove_layout, provenance, topics
from mjspace.log.rows import due
from mjspace.log.scene import scene
from mjspace.log.schema import Scene
from mjspace.log.writer import LogWriter
from mjspace.scenario.boresight import ANGLES
from mjspace.scenario.loading import to_toml
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.recording import Block, one_vehicle, shapes
from mjspace.units import Unit
from mjspace.vehicle import vehicle
from mjspace.vehicle.indices import bus_id
from mjspace.vehicle.moving_parts import reports

_described: dict[bytes, tuple[bytes, Scene]] = {}
"""Of the last model, 10 MB."""


def units_of(
    assembly: Assembly, kinds: Mapping[str, Mapping[str, type]] = {}
) -> dict[str, dict[str, Unit]]:
    """Return the unit of each logged field by topic, as contract, law, actuators and sensors say.

    ``kinds`` are the named tuples that the flight records, as ``topics.units`` takes them.
    """
    units = topics.units(kinds)
    for topic, declared in assembly.actuators.units.items():
        units[topic] |= {name: Unit(unit) for name, unit in declared.items()}
    of_model = {own.field: Unit(own.unit) for own in assembly.vehicle.sensors if own.unit}
    units["/measurement"] |= of_model
    units["/truth"] |= of_model
    for name, sensor in assembly.scenario.sensors.items():
        quantity = sensor.quantity(name)
        unit = of_model.get(quantity) or (Unit(sensor.unit) if sensor.unit else None)
        if unit is not None:
            units["/measurement"].setdefault(name, unit)
            units["/truth"].setdefault(quantity, unit)
    for report in reports(assembly.scenario.plant.moving_parts):
        units["/truth"][report.field] = Unit(report.unit)
    for name in assembly.scenario.plant.boresights:
        units["/truth"] |= {f"{name}_{angle}": Unit("rad") for angle in ANGLES}
    return units


class FlightLog:
    """The open log of one vehicle's flight; a context manager."""

    def __init__(self, assembly: Assembly, path: Path, member: int, first: Block) -> None:
        """Create the log at ``path``; ``first`` is the flight's first block, for its shapes.

        Raises:
            OSError: the file cannot be written.
        """
        scenario, self._model = assembly.scenario, assembly.vehicle.model
        self._data = mujoco.MjData(self._model)
        self._every = scenario.log.every(scenario.rates.control)
        self._first = first.period
        self._last: dict[str, tuple[Array, Array]] = {}
        """Time (1,) [s] and values of the last period, of each viewers' topic that lacks it."""
        bus = self._model.body(bus_id(self._model)).name
        compiled, drawn = described(self._model)
        topics = shapes(first)
        attachments = {
            "model.mjb.gz": ("application/gzip", compiled),
            "scenario.toml": ("application/toml", to_toml(scenario).encode()),
            "foxglove_layout.json": ("application/json", foxglove_layout.layout(bus, topics)),
        }
        for name, content in assembly.sources.items():
            is_code = name.endswith(".py")
            media_type = "text/x-python" if is_code else "application/octet-stream"
            attachments[name] = (media_type, content)
        self._log = LogWriter(
            path,
            topics,
            provenance.metadata(scenario, compiled, member),
            attachments,
            drawn,
            units_of(assembly, first.kinds),
            self._every,
            self._first,
            located=bus if "latitude" in first.rows["/truth"] else "",
        )

    def write(self, block: Block) -> None:
        """Log a block of a flight of one vehicle.

        Raises:
            OSError: the log cannot be written (any more).
        """
        rows = one_vehicle(block)
        # What goes into a chunk beside the periods must be handed over before them.
        sequence = block.period - self._first + np.arange(len(block.time))
        self._last = {}
        for topic, values in _shown(rows).items():
            chosen = due(self._first, sequence, self._every[topic])
            self._show(topic, block.time[chosen], values[chosen])
            if sequence[-1] not in sequence[chosen]:
                self._last[topic] = block.time[-1:], values[-1:].copy()
        for time, _, level, text in block.events:
            self._log.event(time, level, text)
        self._log.write(block.time, rows)

    def event(self, time: float, level: str, text: str) -> None:
        """Log ``text`` at ``time`` [s]; ``level`` is INFO, WARNING or ERROR."""
        self._log.event(time, level, text)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: Any) -> None:
        try:
            for topic, (time, values) in self._last.items():
                self._show(topic, time, values)
        finally:
            self._log.close()

    def _show(self, topic: str, time: Array, values: Array) -> None:
        """Log what ``_shown`` returned of a topic, at ``time`` (n,) [s]."""
        if topic == "/tf":
            self._write_frames(time, values)
        else:
            self._log.write_locations(time, values)

    def _write_frames(self, time: Array, rows: Array) -> None:
        """Log frames at ``time`` (n,) [s]: of the ``rows`` (n, nstate + 7) of ``_shown``."""
        states, desired = rows[:, :-7], rows[:, -7:]
        # Where a body has the reference's name, the last one is not logged.
        positions = np.empty((len(time), self._model.nbody, 3))
        quaternions = np.empty((len(time), self._model.nbody, 4))
        for i, state in enumerate(states):
            mujoco.mj_setState(self._model, self._data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
            mujoco.mj_kinematics(self._model, self._data)
            positions[i, :-1], quaternions[i, :-1] = self._data.xpos[1:], self._data.xquat[1:]
        positions[:, -1], quaternions[:, -1] = desired[:, :3], desired[:, 3:]
        self._log.write_transforms(time, positions, quaternions)


def _shown(rows: Mapping[str, Mapping[str, Array]]) -> dict[str, Array]:
    """Return what goes on each topic for viewers, (n, k): states, and places on the Earth.

    A row for /tf ends with the frame of the reference: its position, or else the bus's, and its
    attitude.
    """
    truth, reference = rows["/truth"], rows["/reference"]
    place = reference.get("position", truth["position"])
    shown = [rows["/state"]["physics"], place, reference["attitude"]]
    found = {"/tf": np.hstack(shown)}
    if "latitude" in truth:
        angles = np.degrees(np.hstack([truth["latitude"], truth["longitude"]]))
        found["/location"] = np.hstack([angles, truth["height"]])
    return found


def described(model: Any) -> tuple[bytes, Scene]:
    """Return a compiled model as it is attached, and what viewers draw of it.

    It is done once for consecutive flights of one model in a process.
    """
    mjb = vehicle.to_mjb(model)
    found = _described.get(mjb)
    if found is None:
        found = vehicle.packed(mjb), scene(model)
        _described.clear()
        _described[mjb] = found
    return found
