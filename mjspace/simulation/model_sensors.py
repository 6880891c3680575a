"""What the sensors of a user's own model read at each control instant.

Those of forces and accelerations, as accelerometers and touch, are evaluated there too: under the
command that has been in force up to that instant, which the law's next one follows. They are the
state's alone, so that a replay may begin at any control instant.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import mujoco
import numpy as np

from mjspace.contract import Array, Event, Measurement
from mjspace.simulation.burning_mass import BurningMass
from mjspace.simulation.sensed_weight import SensedWeight, weights_of
from mjspace.vehicle.indices import columns_of
from mjspace.vehicle.model_sensors import ModelSensor
from mjspace.vehicle.step_effect import State, StepEffect

PREFIX = "model_sensor_"


@dataclass(eq=False, kw_only=True)
class ModelSensors(StepEffect):
    """Reads them at each control instant into the truth, which then has a field for each."""

    name: ClassVar[str] = "the model's own sensors"
    not_compiled = ""
    looks: ClassVar[bool] = True

    model: Any
    columns: dict[str, slice]
    """Of ``sensordata``, by the field."""
    of_forces: bool
    weights: tuple[SensedWeight, ...]
    """What gravity changes in those that feel it; none without gravity."""
    burning: BurningMass | None
    """What tells of the bodies that lose propellant."""
    _batch: Any = field(init=False, repr=False, default=None)
    _sensordata: Any = field(init=False, repr=False, default=None)

    @classmethod
    def of(
        cls,
        model: Any,
        sensors: Sequence[ModelSensor],
        gravity: Callable[[Array], Array] | None,
        burning: BurningMass | None,
    ) -> Self | None:
        """Return the effect for the ``sensors``; None without any.

        ``gravity`` returns what acts on the vehicle [m/s^2], (..., 3), at positions [m], (..., 3).
        ``burning`` has the masses of an instant; None where none burns.
        """
        if not sensors:
            return None
        columns = {each.field: columns_of(model, each.name) for each in sensors}
        weights = () if gravity is None else tuple(weights_of(model, sensors, gravity))
        return cls(
            model=model,
            columns=columns,
            of_forces=any(each.of_forces for each in sensors),
            weights=weights,
            burning=burning,
        )

    def bind(self, batch: Any) -> None:
        """Take the batch and its sensors."""
        self._batch, self._sensordata = batch, batch.bind("sensordata")

    def reset(self, physics: Array) -> State:
        """Return what they read at ``physics`` (N, nstate)."""
        data = mujoco.MjData(self.model)
        read = []
        for row in physics:
            mujoco.mj_setState(self.model, data, row, mujoco.mjtState.mjSTATE_INTEGRATION)
            mujoco.mj_forward(self.model, data)
            read.append(data.sensordata.copy())
        return self.look({}, physics, np.array(read))[0]

    def observe(self, memory: State, physics: Array, time: float, events: list[Event]) -> State:
        """Return the memory with what they read at a control instant."""
        # At stage POS alone, MuJoCo 4.0 computes no kinetic energy in the step that follows.
        stage = mujoco.mjtStage.mjSTAGE_ACC if self.of_forces else mujoco.mjtStage.mjSTAGE_VEL
        self._batch.forward(stage=stage)
        return self.look(memory, physics, self._sensordata.copy())[0]

    def look(self, memory: State, physics: Array, sensordata: Array) -> tuple[State, Array]:
        """Return the memory with what they read now; there is no event."""
        read = {name: sensordata[:, part] for name, part in self.columns.items()}
        burning = self._burning(memory) if self.weights else {}
        for weight in self.weights:
            read[weight.field] = read[weight.field] - weight.felt(sensordata, burning)
        named = {f"{PREFIX}{name}": values for name, values in read.items()}
        return memory | named, np.zeros((len(physics), 1), bool)

    def _burning(self, memory: State) -> dict[int, Array]:
        """Return the mass [kg], (N,), of each body that burns; none as the flight begins."""
        if self.burning is None or not memory:
            return {}
        changes = self.burning.masses(memory, memory)
        return {body: values for field, body, values in changes if field == "body_mass"}

    def add_to_truth(self, memory: State, truth: Measurement) -> Measurement:
        """Return the truth with a field for each sensor."""
        return truth._replace(**{name: memory[f"{PREFIX}{name}"] for name in self.columns})
