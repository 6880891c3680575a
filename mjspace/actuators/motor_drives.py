"""Electric motors on hinges, as the actuators of a vehicle: voltages in, torques on joints out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from pydantic import ConfigDict, RootModel

from mjspace.actuators.base import (
    ActuatorTable,
    Context,
    Fields,
    State,
)
from mjspace.actuators.driven_hinges import HingeMotors, gimbals_and_wheels
from mjspace.actuators.pmsm import Drives, Pmsm
from mjspace.contract import Array, Measurement
from mjspace.scenario.equipment import Driven
from mjspace.scenario.fields import Name


class DriveTables(ActuatorTable, RootModel[dict[Name, Pmsm]]):
    """The motors of a vehicle, by the hinge that each turns."""

    model_config = ConfigDict(frozen=True)
    excludes: ClassVar[tuple[str, ...]] = ("servos", "engine", "wheels")

    @property
    def fitted(self) -> bool:
        """Whether there are any."""
        return bool(self.root)

    def driven_hinges(self, hinges: Sequence[str]) -> Driven:
        """Return all of them; each has its drive."""
        for name in self.root:
            if name not in hinges:
                raise ValueError(
                    f"plant.drives.{name}: no motor turns it: have {', '.join(hinges)}"
                )
        if left := set(hinges).difference(self.root):
            raise ValueError(f"plant.drives: {', '.join(sorted(left))} has a motor and no drive")
        return gimbals_and_wheels(hinges)

    def actuator(self, context: Context) -> "MotorDrives":
        """Return the drives of a vehicle's driven hinges."""
        tables = [self.root[name] for name in context.driven.motors]
        return MotorDrives(Drives.of(tables), driven=context.driven)


@dataclass(frozen=True)
class MotorDrives(HingeMotors):
    """Synchronous motors with their currents; each pushes against what carries its rotor."""

    electrical: Drives

    measures: ClassVar[dict[str, str]] = {"current": "A"}

    @property
    def takes(self) -> Fields:
        """The fields of a command."""
        return {"voltage": ((len(self.order), 2), "V")}

    def reset(self, vehicles: int) -> State:
        """Return currents of zero: "current", (N, m, 2) [A]."""
        return {"current": np.zeros((vehicles, len(self.order), 2))}

    def limits(self) -> dict[str, tuple[Array, Array]]:
        """Return the supplies' voltages."""
        longest = np.repeat(self.electrical.voltage_limit[:, None], 2, axis=1)
        return {"voltage": (-longest, longest)}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, mean torque of the step [N m], whether the voltage saturates)."""
        speeds = np.concatenate([truth.gimbal_rate, truth.wheel_speed], axis=-1)
        angles = np.concatenate([truth.gimbal_angle, truth.wheel_angle], axis=-1)
        # Half the time of an index array.
        speed, angle = speeds.take(self.order, axis=-1), angles.take(self.order, axis=-1)
        current, torque, applied = self.electrical.advance(
            state["current"], command.voltage, speed, step, angle
        )
        saturated = (applied != command.voltage).any(axis=-1)
        return {"current": current}, torque, saturated

    def measured(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with the motors' currents."""
        return truth._replace(current=state["current"])
