"""Speed loops on gimbals and on the wheels in them: rates in, torques on joints out."""

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numba import guvectorize

from mjspace.actuators.base import Fields, State
from mjspace.contract import Array, Measurement
from mjspace.scenario.servos import Servos
from mjspace.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class GimbalServos:
    """Gimbals that obey a ``GimbalRateCommand``, and wheels that keep their speed.

    A motor's torque is held for an integration step, and has its reaction on what carries the
    hinge. The integral of a loop waits while its motor gives all it can.
    """

    loops: Array
    """Gain, integral gain, limits of torque and rate of each gimbal, then each wheel; (m, 4)."""
    wheel_speed: Array
    """Wanted of each wheel [rad/s], shape (n,)."""
    order: Any
    """Where each motor's hinge is among gimbals and wheels, shape (m,)."""

    logged_as: ClassVar[str] = "motor_torque"
    acts_on: ClassVar[str] = "ctrl"
    stateful: ClassVar[bool] = True

    @classmethod
    def of(cls, vehicle: Vehicle, table: Servos) -> Self:
        """Return the loops of a vehicle's driven hinges."""
        gimbal = [table.rate_gain, table.integral_gain, table.torque_limit, table.rate_limit]
        wheel = [table.wheel_gain, table.wheel_integral_gain, table.wheel_torque_limit, None]
        gimbals, wheels = len(vehicle.gimbal_dof), len(vehicle.wheel_dof)
        rows = [gimbal] * gimbals + [wheel] * wheels
        loops = [[np.inf if number is None else number for number in row] for row in rows]
        sensed = [*vehicle.gimbal_dof, *vehicle.wheel_dof]
        order = [sensed.index(dof) for dof in vehicle.drive_dof]
        return cls(np.array(loops), np.full(wheels, table.wheel_speed), np.array(order))

    @property
    def takes(self) -> Fields:
        """The fields of a command."""
        return {"gimbal_rate": (len(self.order) - len(self.wheel_speed), "rad/s")}

    def reset(self, vehicles: int) -> State:
        """Return integrals of zero: "servo_integral" (N, m) [rad], of gimbals and then wheels."""
        return {"servo_integral": np.zeros((vehicles, len(self.order)))}

    def limits(self) -> dict[str, tuple[Array, Array]]:
        """Return the fastest rate of each gimbal."""
        largest = self.loops[: len(self.order) - len(self.wheel_speed), 3]
        return {"gimbal_rate": (-largest, largest)}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, torque [N m], whether rate or torque is cut), (N, m), in motors' order."""
        gimbal_rate = np.asarray(command.gimbal_rate, dtype=float).reshape(truth.gimbal_rate.shape)
        wheel_speed = np.broadcast_to(self.wheel_speed, truth.wheel_speed.shape)
        wanted = np.concatenate([gimbal_rate, wheel_speed], axis=-1)
        rate = np.concatenate([truth.gimbal_rate, truth.wheel_speed], axis=-1)
        before = state["servo_integral"]
        integral, torque, cut = _hold_speed.ufunc(before, wanted, rate, self.loops, step)
        in_order = torque.take(self.order, axis=-1), cut.take(self.order, axis=-1)
        return {"servo_integral": integral}, *in_order

    def seen(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth: the hinges' angles and rates are in it."""
        return truth


@guvectorize(
    ["void(f8[:],f8[:],f8[:],f8[:,:],f8,f8[:],f8[:],f8[:])"],
    "(m),(m),(m),(m,d),()->(m),(m),(m)",
    cache=True,
)
def _hold_speed(
    before: Any, wanted: Any, rate: Any, loops: Any, step: Any, after: Any, torque: Any, cut: Any
) -> None:
    for i in range(rate.size):
        gain, integral_gain, torque_limit, rate_limit = loops[i]
        goal = min(max(wanted[i], -rate_limit), rate_limit)
        error = goal - rate[i]
        integral = before[i] + error * step
        asked = gain * error + integral_gain * integral
        torque[i] = min(max(asked, -torque_limit), torque_limit)
        full = torque[i] != asked
        after[i] = before[i] if full and error * asked > 0.0 else integral
        cut[i] = 1.0 if full or goal != wanted[i] else 0.0
