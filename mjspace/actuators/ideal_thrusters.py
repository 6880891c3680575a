"""Ideal thrusters: the torque that the law commands acts on the bus, unchanged."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from pydantic import ConfigDict, RootModel

from mjspace.actuators.base import (
    BUS_TORQUE,
    Actuator,
    ActuatorTable,
    Context,
    Fields,
    Input,
    State,
)
from mjspace.contract import Array, Measurement
from mjspace.scenario.fields import Switch


class Switched(ActuatorTable, RootModel[Switch]):
    """Whether the vehicle has ideal thrusters."""

    model_config = ConfigDict(frozen=True)

    @property
    def fitted(self) -> bool:
        """Whether it has them."""
        return self.root

    def actuator(self, context: Context) -> "IdealThrusters":
        """Return them; beside other actuators they have a field of the command of their own."""
        return IdealThrusters("thruster_torque" if context.before else "torque")


@dataclass(frozen=True)
class IdealThrusters(Actuator):
    """Thrusters of which nothing is modelled but their torque, which is the commanded one."""

    obeys: str = "torque"
    """The field of the command."""

    logged_as: ClassVar[str] = "thruster_torque"
    unit: ClassVar[str] = "N m"
    drives: ClassVar[Input] = BUS_TORQUE

    @property
    def takes(self) -> Fields:
        """The torque on the bus, body axes."""
        return {self.obeys: (3, "N m")}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return the commanded torque, body axes, (N, 3), which never saturates."""
        torque = getattr(command, self.obeys)
        return state, torque, np.zeros((len(torque), 0))
