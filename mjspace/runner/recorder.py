"""A flight's log: its attachments, and blocks of control periods as they are flown."""

from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Self

import mujoco
import numpy as np

from mjspace.log import foxglove_layout, provenance, topics
from mjspace.log.scene import scene
from mjspace.log.writer import LogWriter
from mjspace.scenario.loading import to_toml
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.recording import Block, one_vehicle, shapes
from mjspace.units import Unit
from mjspace.vehicle import vehicle

FRAME_PERIOD = 0.01  # s: /tf has every body at most 100 times a second


def units_of(assembly: Assembly, kinds: Mapping[str, type] = {}) -> dict[str, dict[str, Unit]]:
    """Return the unit of each logged field by topic, as contract, law, actuators and sensors say.

    ``kinds`` are the named tuples that the flight records, by topic.
    """
    units = topics.units(kinds)
    for topic, declared in assembly.actuators.units.items():
        units[topic] |= {name: Unit(unit) for name, unit in declared.items()}
    for name, sensor in assembly.scenario.sensors.items():
        if sensor.unit:
            units["/measurement"].setdefault(name, Unit(sensor.unit))
            units["/truth"].setdefault(sensor.measures, Unit(sensor.unit))
    return units


class Recorder:
    """The open log of one vehicle's flight; a context manager."""

    def __init__(self, assembly: Assembly, path: Path, member: int, first: Block) -> None:
        """Create the log at ``path``; ``first`` is the flight's first block, for its shapes.

        Raises:
            OSError: the file cannot be written.
        """
        model = assembly.vehicle.model
        compiled = vehicle.to_bytes(model)
        attachments = {
            "model.mjb.gz": ("application/gzip", compiled),
            "scenario.toml": ("application/toml", to_toml(assembly.scenario).encode()),
            "foxglove_layout.json": ("application/json", foxglove_layout.layout()),
        }
        for name, content in assembly.sources.items():
            is_code = name.endswith(".py")
            media_type = "text/x-python" if is_code else "application/octet-stream"
            attachments[name] = (media_type, content)
        self._log = LogWriter(
            path,
            shapes(first),
            provenance.metadata(assembly.scenario, compiled, member),
            attachments,
            scene(model),
            units_of(assembly, first.kinds),
        )
        self._model, self._data = model, mujoco.MjData(model)
        self._stride = max(1, round(FRAME_PERIOD / assembly.scenario.rates.control))
        self.time: float
        """Of the last period written [s]."""

    def write(self, block: Block) -> None:
        """Log a block of a flight of one vehicle.

        Raises:
            OSError: the log cannot be written any more.
        """
        rows = one_vehicle(block)
        # What goes into a chunk beside the periods must be handed over before them.
        self._write_frames(block, rows["/state"]["physics"])
        for time, _, level, text in block.events:
            self._log.event(time, level, text)
        self._log.write(block.time, rows)
        self.time = float(block.time[-1])

    def event(self, level: str, text: str) -> None:
        """Log ``text`` at the flight's present time; ``level`` is INFO, WARNING or ERROR."""
        self._log.event(self.time, level, text)

    def flush(self) -> None:
        """Wait until everything logged so far can be read from the file."""
        self._log.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._log.__exit__(kind, error, trace)

    def _write_frames(self, block: Block, physics: np.ndarray) -> None:
        due = np.flatnonzero((block.period + np.arange(len(block.time))) % self._stride == 0)
        positions = np.empty((len(due), self._model.nbody - 1, 3))
        quaternions = np.empty((len(due), self._model.nbody - 1, 4))
        for i, k in enumerate(due):
            mujoco.mj_setState(
                self._model, self._data, physics[k], mujoco.mjtState.mjSTATE_INTEGRATION
            )
            mujoco.mj_kinematics(self._model, self._data)
            positions[i], quaternions[i] = self._data.xpos[1:], self._data.xquat[1:]
        self._log.write_transforms(block.time[due], positions, quaternions)
