"""Electric motors on hinges, as the actuators of a vehicle: voltages in, torques on joints out."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from mjspace.actuators.base import Fields, State
from mjspace.actuators.pmsm import Drives
from mjspace.contract import Array, Measurement
from mjspace.scenario.motors import Pmsm
from mjspace.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class MotorDrives:
    """Synchronous motors with their currents; each pushes against what carries its rotor."""

    drives: Drives
    order: Any
    """Where each motor's speed is among gimbal rates and wheel speeds, shape (m,)."""

    logged_as: ClassVar[str] = "motor_torque"
    acts_on: ClassVar[str] = "ctrl"
    stateful: ClassVar[bool] = True

    @classmethod
    def of(cls, vehicle: Vehicle, tables: Sequence[Pmsm]) -> Self:
        """Return the drives of a vehicle's driven hinges; ``tables`` are in their order."""
        sensed = [*vehicle.gimbal_dof, *vehicle.wheel_dof]
        order = [sensed.index(dof) for dof in vehicle.drive_dof]
        return cls(Drives.of(tables), np.array(order))

    @property
    def takes(self) -> Fields:
        """The fields of a command."""
        return {"voltage": ((len(self.order), 2), "V")}

    def reset(self, vehicles: int) -> State:
        """Return currents of zero: "current", (N, m, 2) [A]."""
        return {"current": np.zeros((vehicles, len(self.order), 2))}

    def limits(self) -> dict[str, tuple[Array, Array]]:
        """Return the supplies' voltages."""
        longest = np.repeat(self.drives.voltage_limit[:, None], 2, axis=1)
        return {"voltage": (-longest, longest)}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, mean torque of the step [N m], whether the voltage was cut)."""
        speeds = np.concatenate([truth.gimbal_rate, truth.wheel_speed], axis=-1)
        angles = np.concatenate([truth.gimbal_angle, truth.wheel_angle], axis=-1)
        # Half the time of an index array.
        speed, angle = speeds.take(self.order, axis=-1), angles.take(self.order, axis=-1)
        current, torque, applied = self.drives.advance(
            state["current"], command.voltage, speed, step, angle
        )
        cut = (applied != command.voltage).any(axis=-1)
        return {"current": current}, torque, cut

    def seen(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with the motors' currents."""
        return truth._replace(current=state["current"])
