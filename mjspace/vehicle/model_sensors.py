"""The sensors of a user's own model, as it has them at each control instant."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple, Self

import mujoco
import numpy as np

from mjspace.contract import Array, Event, Measurement
from mjspace.vehicle.step_effect import State, StepEffect

_OF_FORCES = int(mujoco.mjtStage.mjSTAGE_ACC)
PREFIX = "model_sensor_"
_UNITS = {
    **dict.fromkeys(("gyro", "frameangvel", "ballangvel"), "rad/s"),
    **dict.fromkeys(("velocimeter", "framelinvel", "subtreelinvel", "tendonvel"), "m/s"),
    **dict.fromkeys(("framepos", "subtreecom", "rangefinder", "tendonpos"), "m"),
    "subtreeangmom": "N m s",
    "clock": "s",
}


class ModelSensor(NamedTuple):
    """A sensor that the vehicle's model itself has."""

    name: str
    """As the model has it."""
    field: str
    """Of the measurement: the name with an underscore for what no name in Python can have."""
    kind: str
    """MuJoCo's: "gyro", "framequat", ...."""
    size: int
    """How many numbers it reports."""
    unit: str
    """Of what it reports; "" for numbers, and where MuJoCo leaves it open."""
    measured: bool
    """Whether a law receives it: not, where it depends on forces, as an accelerometer does."""


def sensors_of(model: Any) -> tuple[ModelSensor, ...]:
    """Return the sensors of a compiled model whose sensors have names."""
    found = []
    taken = {*Measurement.__annotations__}
    for i in range(model.nsensor):
        name = model.sensor(i).name
        plain = re.sub(r"\W|^(?=\d)", "_", name)
        plain = f"model_{plain}" if plain in taken or plain.startswith("_") else plain
        taken.add(plain)
        kind = mujoco.mjtSensor(model.sensor_type[i]).name.removeprefix("mjSENS_").lower()
        size, measured = int(model.sensor_dim[i]), bool(model.sensor_needstage[i] < _OF_FORCES)
        found.append(ModelSensor(name, plain, kind, size, _unit(model, i, kind), measured))
    return tuple(found)


def _unit(model: Any, sensor: int, kind: str) -> str:
    if kind not in ("jointpos", "jointvel"):
        return _UNITS.get(kind, "")
    hinge = model.jnt_type[model.sensor_objid[sensor]] == mujoco.mjtJoint.mjJNT_HINGE
    return ("rad" if hinge else "m") + ("/s" if kind == "jointvel" else "")


@dataclass(eq=False)
class ModelSensors(StepEffect):
    """Reads them at each control instant into the truth, which then has a field for each."""

    name: ClassVar[str] = "the model's own sensors"
    not_compiled = ""
    looks: ClassVar[bool] = True

    model: Any
    columns: dict[str, slice]
    """Of ``sensordata``, by the field."""
    _batch: Any = field(init=False, repr=False, default=None)
    _sensordata: Any = field(init=False, repr=False, default=None)

    @classmethod
    def of(cls, model: Any, sensors: Sequence[ModelSensor]) -> Self | None:
        """Return the effect for the measured ones of the ``sensors``; None without any."""
        columns = {}
        for sensor in sensors:
            if sensor.measured:
                first = int(model.sensor(sensor.name).adr[0])
                columns[sensor.field] = slice(first, first + sensor.size)
        return cls(model, columns) if columns else None

    def bind(self, batch: Any) -> None:
        """Take the batch and its sensors."""
        self._batch, self._sensordata = batch, batch.bind("sensordata")

    def reset(self, physics: Array) -> State:
        """Return what they read at ``physics`` (N, nstate)."""
        data = mujoco.MjData(self.model)
        read = []
        for row in physics:
            mujoco.mj_setState(self.model, data, row, mujoco.mjtState.mjSTATE_INTEGRATION)
            mujoco.mj_step1(self.model, data)
            read.append(data.sensordata.copy())
        return self.look({}, physics, np.array(read))[0]

    def observe(self, memory: State, physics: Array, time: float, events: list[Event]) -> State:
        """Return the memory with what they read at a control instant."""
        # At stage POS alone, MuJoCo 4.0 computes no kinetic energy in the step that follows.
        self._batch.forward(stage=mujoco.mjtStage.mjSTAGE_VEL)
        return self.look(memory, physics, self._sensordata.copy())[0]

    def look(self, memory: State, physics: Array, sensordata: Array) -> tuple[State, Array]:
        """Return the memory with what they read now; there is no event."""
        read = {f"{PREFIX}{name}": sensordata[:, part] for name, part in self.columns.items()}
        return memory | read, np.zeros((len(physics), 1), bool)

    def add_to_truth(self, memory: State, truth: Measurement) -> Measurement:
        """Return the truth with a field for each sensor."""
        return truth._replace(**{name: memory[f"{PREFIX}{name}"] for name in self.columns})
