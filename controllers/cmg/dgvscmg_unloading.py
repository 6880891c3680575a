"""The cascade of the double-gimbal CMG, with unloading of its wheel by thrusters.

A biased disturbance adds momentum until the wheel is saturated. The thesis (paper 001) has no
unloading. Here thrusters give the torque -k Jw (W - W0) s along the spin axis s, and the wheel
compensates it: its acceleration changes by -k (W - W0), the gimbal rates stay, and the net torque
on the bus is zero.
"""

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, Reference, Unit, gain

from . import dgvscmg, steering


class Command(NamedTuple):
    """Command of the attitude loop to the motors' loops and the thrusters, for one period."""

    gimbal_rate: Annotated[Array, Unit("rad/s")]
    acceleration: Annotated[Array, Unit("rad/s^2")]
    load: Annotated[Array, Unit("N m")]
    """These three as in ``dgvscmg.SpeedCommand``."""
    thruster_torque: Annotated[Array, Unit("N m")]
    """On the bus, body axes [N m], (..., 3)."""


class MotorCommand(NamedTuple):
    """Command of the inner loop to inverters and thrusters."""

    voltage: Annotated[Array, Unit("V")]
    """As in ``VoltageCommand`` [V], (..., 3, 2)."""
    thruster_torque: Annotated[Array, Unit("N m")]
    """On the bus, body axes [N m], (..., 3)."""


@dataclass(frozen=True)
class Unloading(dgvscmg.Cascade):
    """The ``Cascade`` with unloading of the wheel towards a bias speed."""

    bias_speed: float = gain("rad/s", default=73.0)
    """W0."""
    unloading_gain: float = gain("1/s", default=0.1, at_least=0.0)
    """k: should be slower than the manoeuvre, or the thrusters exchange its momentum, too."""
    thruster_limit: float = gain("N m", default=0.1, at_least=0.0, at_most=np.inf)
    """Largest commanded torque of the thrusters."""

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, Any, dgvscmg.Signals]:
        """Return the cascade's command with the unloading added."""
        state, command, signals = super().step(state, time, measurement, reference)
        Jw, angle = self.rotor_inertia, measurement.gimbal_angle
        unlimited = -self.unloading_gain * (measurement.wheel_speed - self.bias_speed)
        most = self.thruster_limit / Jw
        slowing = np.minimum(np.maximum(unlimited, -most), most)
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
        return state, unloading, signals

    def inner(
        self, state: Any, time: float, command: Any, measurement: Measurement
    ) -> tuple[Any, Any]:
        """Return the motors' voltages, and the thrusters' torque as last commanded."""
        state, motors = super().inner(state, time, command, measurement)
        return state, MotorCommand(motors.voltage, command.thruster_torque)
