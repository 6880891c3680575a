"""The cascade of the double-gimbal CMG, whose wheel thrusters bring back to its bias speed.

A disturbance with a bias brings momentum until the wheel turns faster than its motor can. The
thesis (paper 001) models no unloading; this is ours. Thrusters give the bus -k Jw (W - W0) s, along
the wheel's axis s, and the wheel takes it up: its acceleration changes by -k (W - W0), the gimbals'
rates by nothing, and the bus feels neither.
"""

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, Reference, Unit, gain

from . import dgvscmg, steering


class Command(NamedTuple):
    """What the attitude loop asks of the motors' loops and the thrusters, for its period."""

    gimbal_rate: Annotated[Array, Unit("rad/s")]
    acceleration: Annotated[Array, Unit("rad/s^2")]
    load: Annotated[Array, Unit("N m")]
    """These three as ``dgvscmg.SpeedCommand`` has them."""
    thruster_torque: Annotated[Array, Unit("N m")]
    """On the bus, body axes [N m], (..., 3)."""


class MotorCommand(NamedTuple):
    """What the inner loop asks of inverters and thrusters."""

    voltage: Annotated[Array, Unit("V")]
    """As ``VoltageCommand`` has it [V], (..., 3, 2)."""
    thruster_torque: Annotated[Array, Unit("N m")]
    """On the bus, body axes [N m], (..., 3)."""


@dataclass(frozen=True)
class Unloading(dgvscmg.Cascade):
    """The ``Cascade`` that holds its wheel near a speed."""

    bias_speed: float = gain("rad/s", default=73.0)
    """W0."""
    unloading_gain: float = gain("1/s", default=0.1, at_least=0.0)
    """k: slower than the manoeuvre, whose momentum the thrusters would give and take else."""
    thruster_limit: float = gain("N m", default=0.1, at_least=0.0, at_most=np.inf)
    """Largest torque that is asked of the thrusters."""

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, Any, dgvscmg.Signals]:
        """Return the cascade's command with what unloads the wheel."""
        state, command, shown = super().step(state, time, measurement, reference)
        Jw, angle = self.rotor_inertia, measurement.gimbal_angle
        wanted = -self.unloading_gain * (measurement.wheel_speed - self.bias_speed)
        most = self.thruster_limit / Jw
        slowing = np.minimum(np.maximum(wanted, -most), most)
        along = steering.torque_matrix(angle, measurement.wheel_speed, Jw)[..., 2]  # Jw s
        eta = np.concatenate([np.zeros_like(angle), slowing], axis=-1)
        # The outer gimbal's motor holds its part of the wheel's acceleration.
        held = steering.gimbal_load(
            np.zeros_like(measurement.rate), angle, eta, np.zeros_like(slowing), Jw
        )
        held = np.concatenate([self.gyroscopic_feedforward * held, np.zeros_like(slowing)], axis=-1)
        unloading = Command(
            command.gimbal_rate,
            command.acceleration + eta,
            command.load + held,
            slowing * along,
        )
        return state, unloading, shown

    def inner(
        self, state: Any, time: float, command: Any, measurement: Measurement
    ) -> tuple[Any, Any]:
        """Return the motors' voltages, and the thrusters' torque for as long as it is held."""
        state, motors = super().inner(state, time, command, measurement)
        return state, MotorCommand(motors.voltage, command.thruster_torque)
