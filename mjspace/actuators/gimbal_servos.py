"""Speed loops on gimbals and on the wheels in them: rates in, torques on joints out.

Wheels may obey torques instead, as those of variable-speed CMGs do.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from mjspace.actuators.base import (
    ActuatorTable,
    Context,
    Fields,
    State,
)
from mjspace.actuators.driven_hinges import HingeMotors, gimbals_and_wheels
from mjspace.contract import Array, Measurement
from mjspace.gufunc import gufunc
from mjspace.scenario.equipment import Driven
from mjspace.scenario.fields import Finite, NonNegative, Positive, Si, Table
from mjspace.vehicle import indices
from mjspace.vehicle.vehicle import Vehicle


class Servos(ActuatorTable, Table):
    """Speed loops on every hinge of the parts that has a motor: gimbals alike, and wheels alike.

    Reaction wheels of ``[plant.wheels]`` beside them have motors of their own. A hinge whose name
    ends in ``wheel`` is a wheel, any other a gimbal. A loop is proportional and integral, and its
    motor acts against what carries the hinge.
    """

    excludes: ClassVar[tuple[str, ...]] = ("engine",)

    rate_limit: Annotated[Positive, Si("rad/s")] | None = None
    """Fastest rate that a gimbal is commanded; none when left out."""
    torque_limit: Annotated[Positive, Si("N m")] | None = None
    """Largest torque of a gimbal's motor; none when left out."""
    rate_gain: Annotated[Positive, Si("N m s/rad")] = 0.8
    """Torque of a gimbal's motor for each rad/s of rate error."""
    integral_gain: Annotated[NonNegative, Si("N m/rad")] = 60.0
    """And for each rad of integrated error."""
    wheel_speed: Annotated[Finite, Si("rad/s")] | None = None
    """Held, relative to the gimbal; where a wheel starts is ``initial.wheel_speed``. Required where
    a hinge is a wheel."""
    wheels_obey: Literal["speed", "torque"] = "speed"
    """What wheels do: keep ``wheel_speed``, or apply the command's ``wheel_torque``, as those of
    variable-speed CMGs do."""
    wheel_torque_limit: Annotated[Positive, Si("N m")] | None = None
    """Largest torque of a wheel's motor; none when left out."""
    wheel_gain: Annotated[Positive, Si("N m s/rad")] = 0.1
    """Torque of a wheel's motor for each rad/s of speed error."""
    wheel_integral_gain: Annotated[NonNegative, Si("N m/rad")] = 0.5
    """And for each rad of integrated error."""

    def driven_hinges(self, hinges: Sequence[str]) -> Driven:
        """Return all of them."""
        if not hinges:
            raise ValueError("no hinge of the parts has a motor that nothing else drives")
        driven = gimbals_and_wheels(hinges)
        if driven.wheels and self.wheel_speed is None and self.wheels_obey == "speed":
            raise ValueError(f"wheel_speed: missing, and {', '.join(driven.wheels)} is a wheel")
        return driven

    def facts(self, vehicle: Vehicle) -> dict[str, Any]:
        """Return the axes of gimbals and of the wheels in them at rest, and the inertia about each.

        ``wheel_inertia`` is that of reaction wheels; where there are none, about the ``spin_axes``.
        """
        reaction_wheels = len(vehicle.wheel_axes)
        spins = vehicle.wheel_dof[reaction_wheels:]
        turns = vehicle.gimbal_dof[len(vehicle.own.gimbals) :]
        found = {
            "gimbal_axes": indices.axes(vehicle.model, turns),
            "gimbal_inertia": indices.axial_inertia(vehicle.model, turns),
            "spin_axes": indices.axes(vehicle.model, spins),
            "spin_inertia": indices.axial_inertia(vehicle.model, spins),
        }
        return found if reaction_wheels else found | {"wheel_inertia": found["spin_inertia"]}

    def actuator(self, context: Context) -> "GimbalServos":
        """Return the loops of a vehicle's driven hinges."""
        gimbal = [self.rate_gain, self.integral_gain, self.torque_limit, self.rate_limit]
        wheel = [self.wheel_gain, self.wheel_integral_gain, self.wheel_torque_limit, None]
        driven = context.driven
        rows = [gimbal] * len(driven.gimbals) + [wheel] * len(driven.wheels)
        loops = [[np.inf if number is None else number for number in row] for row in rows]
        wheel_speed = np.full(len(driven.wheels), self.wheel_speed or 0.0)
        every = context.vehicle.driven
        before = tuple(
            len(of_all) - len(its)
            for of_all, its in ((every.gimbals, driven.gimbals), (every.wheels, driven.wheels))
        )
        kind = GimbalServos if self.wheels_obey == "speed" else VariableSpeedServos
        return kind(np.array(loops), wheel_speed, before, driven=driven)


@dataclass(frozen=True)
class GimbalServos(HingeMotors):
    """Gimbals that obey a ``GimbalRateCommand``, and wheels that keep their speed.

    A motor's torque is held for an integration step, and has its reaction on what carries the
    hinge. The integral of a loop is frozen while its motor saturates.
    """

    loops: Array
    """Gain, integral gain, limits of torque and rate of each gimbal, then each wheel; (m, 4)."""
    wheel_speed: Array
    """Desired of each wheel [rad/s], shape (n,)."""
    before: tuple[int, ...] = (0, 0)
    """How many gimbals, and how many wheels, of others come before its own in the truth."""

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
        """Return (state, torque [N m], whether rate or torque saturates), (N, m), as the motors."""
        gimbals, wheels = self.before
        speed = truth.wheel_speed[..., wheels:]
        wheel_speed = np.broadcast_to(self.wheel_speed, speed.shape)
        desired = np.concatenate([command.gimbal_rate, wheel_speed], axis=-1)
        rate = np.concatenate([truth.gimbal_rate[..., gimbals:], speed], axis=-1)
        integral, torque, saturated = _hold_speed.ufunc(
            state["servo_integral"], desired, rate, self.loops, step
        )
        in_order = torque.take(self.order, axis=-1), saturated.take(self.order, axis=-1)
        return {"servo_integral": integral}, *in_order


@dataclass(frozen=True)
class VariableSpeedServos(GimbalServos):
    """Gimbals that obey a command's ``gimbal_rate``, and wheels that obey its ``wheel_torque``."""

    @property
    def takes(self) -> Fields:
        """The fields of a command."""
        return {**super().takes, "wheel_torque": (len(self.wheel_speed), "N m")}

    def reset(self, vehicles: int) -> State:
        """Return integrals of zero: "servo_integral" (N, g) [rad], of the gimbals."""
        return {"servo_integral": np.zeros((vehicles, len(self.order) - len(self.wheel_speed)))}

    def limits(self) -> dict[str, tuple[Array, Array]]:
        """Return the fastest rate of each gimbal, and the largest torque of each wheel."""
        largest = self.loops[len(self.order) - len(self.wheel_speed) :, 2]
        return {**super().limits(), "wheel_torque": (-largest, largest)}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, torque [N m], whether rate or torque saturates), (N, m), as the motors."""
        count = len(self.order) - len(self.wheel_speed)
        integral, torque, saturated = _hold_speed.ufunc(
            state["servo_integral"],
            command.gimbal_rate,
            truth.gimbal_rate[..., self.before[0] :],
            self.loops[:count],
            step,
        )
        least, largest = self.limits()["wheel_torque"]
        applied = np.minimum(np.maximum(command.wheel_torque, least), largest)
        full = np.where(applied != command.wheel_torque, 1.0, 0.0)
        torques = np.concatenate([torque, applied], axis=-1)
        either = np.concatenate([saturated, full], axis=-1)
        in_order = torques.take(self.order, axis=-1), either.take(self.order, axis=-1)
        return {"servo_integral": integral}, *in_order


@gufunc(
    ["void(f8[:],f8[:],f8[:],f8[:,:],f8,f8[:],f8[:],f8[:])"],
    "(m),(m),(m),(m,d),()->(m),(m),(m)",
)
def _hold_speed(
    before: Any,
    desired: Any,
    rate: Any,
    loops: Any,
    step: Any,
    after: Any,
    torque: Any,
    saturated: Any,
) -> None:
    for i in range(rate.size):
        gain, integral_gain, torque_limit, rate_limit = loops[i]
        goal = min(max(desired[i], -rate_limit), rate_limit)
        error = goal - rate[i]
        integral = before[i] + error * step
        commanded = gain * error + integral_gain * integral
        torque[i] = min(max(commanded, -torque_limit), torque_limit)
        full = torque[i] != commanded
        after[i] = before[i] if full and error * commanded > 0.0 else integral
        saturated[i] = 1.0 if full or goal != desired[i] else 0.0
