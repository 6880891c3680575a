"""A flight's log: its attachments, and blocks of control periods as they are flown and judged."""

from collections.abc import Mapping
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path
from types import TracebackType
from typing import Self

import mujoco
import numpy as np

from mjspace.log import foxglove_layout, provenance, topics
from mjspace.log.background import Background
from mjspace.log.rows import due
from mjspace.log.scene import scene
from mjspace.log.schema import Scene
from mjspace.log.writer import LogWriter
from mjspace.runner.checks import Judge, Verdict
from mjspace.scenario.loading import to_toml
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.recording import Block, one_vehicle, shapes
from mjspace.units import Unit
from mjspace.vehicle import vehicle

AHEAD = 2  # blocks that may wait for the disk: memory stays flat, and a kill costs no more


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
    """The open log of one vehicle's flight, and what judges it; a context manager.

    All of it runs on a thread of its own, at most ``AHEAD`` blocks behind the flight, which waits
    for a slow disk. What it raises there is raised here by the next call; the log then keeps what
    it has.
    """

    def __init__(self, assembly: Assembly, path: Path, member: int, first: Block) -> None:
        """Begin the log at ``path``; ``first`` is the flight's first block, for its shapes.

        Raises:
            ValueError: a check of the scenario names a signal that this flight does not have.
        """
        scenario = assembly.scenario
        self._judge = Judge(scenario.checks, scenario.events, shapes(first))
        self._model, self._data = assembly.vehicle.model, mujoco.MjData(assembly.vehicle.model)
        self._first = first.period
        self._every = scenario.log.every(scenario.rates.control)
        self._log: LogWriter
        self._opened = ExitStack()
        self._thread = Background("log", AHEAD)
        self._thread.call(self._create, assembly, path, member, first)
        self.time: float
        """Of the last period written [s]."""

    def write(self, block: Block) -> None:
        """Log and judge a block of a flight of one vehicle.

        The block is handed over: its arrays are read later, and must not change any more.

        Raises:
            OSError: the log cannot be written (any more).
        """
        self._thread.call(self._write, block)
        self.time = float(block.time[-1])

    def event(self, level: str, text: str) -> None:
        """Log ``text`` at the flight's present time; ``level`` is INFO, WARNING or ERROR."""
        self._thread.call(self._write_event, self.time, level, text)

    def verdicts(self) -> list[Verdict]:
        """Return the verdict of each check on everything written so far.

        Raises:
            OSError: the log cannot be written (any more).
        """
        self._thread.wait()
        return self._judge.verdicts()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            with self._opened:
                self._thread.close()
        except OSError:
            if error is None:
                raise

    def _create(self, assembly: Assembly, path: Path, member: int, first: Block) -> None:
        model = vehicle.to_bytes(self._model)
        attachments = {
            "model.mjb.gz": ("application/gzip", model),
            "scenario.toml": ("application/toml", to_toml(assembly.scenario).encode()),
            "foxglove_layout.json": ("application/json", foxglove_layout.layout()),
        }
        for name, content in assembly.sources.items():
            is_code = name.endswith(".py")
            media_type = "text/x-python" if is_code else "application/octet-stream"
            attachments[name] = (media_type, content)
        self._log = self._opened.enter_context(
            LogWriter(
                path,
                shapes(first),
                provenance.metadata(assembly.scenario, model, member),
                attachments,
                _scene_of(model),
                units_of(assembly, first.kinds),
                self._every,
                self._first,
            )
        )

    def _write(self, block: Block) -> None:
        rows = one_vehicle(block)
        # What goes into a chunk beside the periods must be handed over before them.
        self._write_frames(block, rows["/state"]["physics"])
        for time, _, level, text in block.events:
            self._log.event(time, level, text)
        self._log.write(block.time, rows)
        self._judge.add(block.time, rows)

    def _write_event(self, time: float, level: str, text: str) -> None:
        self._log.event(time, level, text)

    def _write_frames(self, block: Block, physics: np.ndarray) -> None:
        sequence = block.period - self._first + np.arange(len(block.time))
        chosen = due(self._first, sequence, self._every["/tf"])
        time, states = block.time[chosen], physics[chosen]
        positions = np.empty((len(time), self._model.nbody - 1, 3))
        quaternions = np.empty((len(time), self._model.nbody - 1, 4))
        for i, state in enumerate(states):
            mujoco.mj_setState(self._model, self._data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
            mujoco.mj_kinematics(self._model, self._data)
            positions[i], quaternions[i] = self._data.xpos[1:], self._data.xquat[1:]
        self._log.write_transforms(time, positions, quaternions)


@lru_cache(maxsize=2)
def _scene_of(model: bytes) -> Scene:
    return scene(vehicle.from_bytes(model))
