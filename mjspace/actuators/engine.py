"""An engine on two gimbals, as a vehicle's actuators: throttle, servos, propellant."""

import math
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from mjspace.actuators import tank as tanks
from mjspace.actuators.base import (
    Actuator,
    ActuatorTable,
    Context,
    Fields,
    Input,
    State,
    motors,
)
from mjspace.contract import TICK, Array, Measurement
from mjspace.environment.constants import STANDARD_GRAVITY
from mjspace.gufunc import gufunc
from mjspace.scenario.equipment import Driven
from mjspace.scenario.fields import NonNegative, Positive, Seconds, Si, Table, Time

MOTORS = ("engine_outer", "engine_inner", "engine_thrust")
"""Those of a model that has an engine."""
FIELDS = ("thrust", "propellant", "burning", "clock")


class Engine(ActuatorTable, Table):
    """An engine on two gimbals, of a model that has ``engine_outer``, ``_inner`` and ``_thrust``.

    Each gimbal is turned by a position loop around a rate loop; the limit is on the rate that the
    one commands to the other.
    """

    excludes: ClassVar[tuple[str, ...]] = ("wheels",)

    thrust_max: Annotated[Positive, Si("N")]
    """Largest thrust."""
    thrust_min: Annotated[NonNegative, Si("N")] = 0.0
    """Least thrust while it burns; a command of zero puts it out for good."""
    thrust_lag: Time = 0.0
    """Time constant with which the thrust follows its command."""
    specific_impulse: Seconds | None = None
    """Thrust over the weight of the propellant's flow, on Earth; burns nothing when left out."""
    propellant: Annotated[Positive, Si("kg")] | None = None
    """In the tank at the start, the body ``tank``; the model's own when left out."""
    gimbal_limit: Annotated[Positive, Field(le=math.pi), Si("rad")] = 0.35
    """Largest deflection that is commanded to each gimbal."""
    gimbal_rate_limit: Annotated[Positive, Si("rad/s")] | None = None
    """Fastest rate that is commanded; none when left out."""
    gimbal_lag: Seconds = 0.05
    """Time constant of the position loop."""
    gimbal_rate_gain: Annotated[Positive, Si("N m s/rad")] = 10.0
    """Of the rate loop."""
    gimbal_torque_limit: Annotated[Positive, Si("N m")] = 10.0
    """Largest torque of each gimbal's motor, beyond which it is saturated."""
    fails_at: Seconds | None = None
    """When the engine goes out by itself; never when left out."""

    @model_validator(mode="after")
    def _throttle(self) -> "Engine":
        if self.thrust_min > self.thrust_max:
            raise ValueError(
                f"thrust_min {self.thrust_min:g} N is above thrust_max {self.thrust_max:g} N"
            )
        return self

    def driven(self, model: Any) -> Driven:
        """Return the model's own gimbals and engine."""
        names = [model.actuator(index).name for index in range(model.nu)]
        if missing := [name for name in MOTORS if name not in names]:
            raise ValueError(
                f"plant.engine: needs the motors {', '.join(MOTORS)}, as plant.model = 'lander' "
                f"has them; missing: {', '.join(missing)}"
            )
        return Driven(motors=MOTORS, gimbals=MOTORS[:2])

    def actuator(self, context: Context) -> "GimballedEngine":
        """Return the engine of a vehicle that has one, and a body called ``tank``.

        It burns at the start with ``initial.thrust``, by default at trim: it holds the vehicle's
        weight as far as its throttle goes; without gravity it is cold.
        """
        model = context.vehicle.model
        tank = model.body("tank").id
        flow = 0.0
        if self.specific_impulse is not None:
            flow = 1.0 / (self.specific_impulse * STANDARD_GRAVITY)
        data = [
            self.thrust_min,
            self.thrust_max,
            self.thrust_lag,
            flow,
            self.gimbal_limit,
            np.inf if self.gimbal_rate_limit is None else self.gimbal_rate_limit,
            1.0 / self.gimbal_lag,
            self.gimbal_rate_gain,
            np.inf if self.fails_at is None else self.fails_at,
            self.gimbal_torque_limit,
        ]
        held = float(model.body_mass[tank])
        propellant = held if self.propellant is None else self.propellant
        thrust = context.initial.thrust
        if thrust is None:
            weight = (float(np.sum(model.body_mass)) - held + propellant) * context.gravity
            thrust = float(np.clip(weight, self.thrust_min, self.thrust_max)) if weight else 0.0
        return GimballedEngine(
            np.array(data),
            tank if flow else 0,
            model.body_inertia[tank] / held,
            propellant,
            thrust,
        )


@dataclass(frozen=True)
class GimballedEngine(Actuator):
    """One engine; its hinges turn the outer gimbal and then the inner."""

    data: Array
    """The engine's numbers, in the order that the kernel reads them."""
    tank: int
    """The body whose mass is the propellant's; 0: none burns."""
    full: Array
    """Principal moments [kg m^2] of that body for each kilogram in it, shape (3,)."""
    propellant: float
    """At the start [kg]."""
    thrust: float
    """At the start [N]."""

    logged_as: ClassVar[str] = "engine"
    unit: ClassVar[str] = "N m, N m, N"
    takes: ClassVar[Fields] = {"thrust": (1, "N"), "gimbal": (2, "rad")}
    measures: ClassVar[dict[str, str]] = {"thrust": "N", "propellant": "kg"}
    drives: ClassVar[Input] = motors(MOTORS)
    stateful: ClassVar[bool] = True

    def reset(self, vehicles: int) -> State:
        """Return an engine that burns with its thrust of the start.

        Its fields, (N, 1): "thrust" [N], "propellant" [kg], "burning" (1.0 until it is put out or
        has run dry) and "clock" [s].
        """
        one = np.ones((vehicles, 1))
        return {
            "thrust": self.thrust * one,
            "propellant": self.propellant * one,
            "burning": one,
            "clock": 0.0 * one,
        }

    def limits(self) -> dict[str, tuple[Array, Array]]:
        """Return the limits of throttle and deflection; a thrust of zero puts the engine out."""
        largest, deflection = self.data[1], np.full(2, self.data[4])
        return {"thrust": (np.zeros(1), np.full(1, largest)), "gimbal": (-deflection, deflection)}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, [outer torque, inner torque, thrust], saturated), (N, 3)."""
        packed = np.concatenate([state[name] for name in FIELDS], axis=-1)
        commanded = np.concatenate([command.thrust, command.gimbal], axis=-1)
        after, applied, saturated = _engine.ufunc(
            packed, commanded, truth.gimbal_angle, truth.gimbal_rate, self.data, step
        )
        return {name: after[:, i : i + 1] for i, name in enumerate(FIELDS)}, applied, saturated

    def measured(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with thrust and what is left in the tank."""
        return truth._replace(thrust=state["thrust"], propellant=state["propellant"])

    def masses(self, before: State, after: State) -> dict[str, tuple[int, Array]]:
        """Return mass and inertia of the tank."""
        if not self.tank:
            return {}
        return tanks.masses(self.tank, self.full, before["propellant"], after["propellant"])


@gufunc(
    ["void(f8[:],f8[:],f8[:],f8[:],f8[:],f8,f8[:],f8[:],f8[:])"],
    "(s),(c),(g),(g),(d),()->(s),(c),(c)",
)
def _engine(
    state: Any,
    commanded: Any,
    angle: Any,
    rate: Any,
    data: Any,
    step: Any,
    after: Any,
    applied: Any,
    saturated: Any,
) -> None:
    """Advance thrust, tank and clock by ``step`` [s]; compute the torques and the mean thrust."""
    least, most, lag, flow, limit, rate_limit, position_gain, rate_gain, fails_at, strongest = data
    thrust, left, burning, clock = state
    # An engine that is out ignores its command: it does not start twice.
    if commanded[0] <= 0.0 or clock >= fails_at - TICK or left <= 0.0:
        burning = 0.0
    target = burning * min(max(commanded[0], least), most)
    if burning == 0.0:
        thrust = 0.0  # the valves shut at once
    share = np.exp(-step / lag) if lag > 0.0 else 0.0
    ahead = target + (thrust - target) * share
    mean = target + (thrust - target) * (1.0 - share) * lag / step
    after[0], after[1] = ahead, max(left - flow * mean * step, 0.0)
    after[2], after[3] = burning, clock + step
    applied[2], saturated[2] = mean, 1.0 if burning > 0.0 and target != commanded[0] else 0.0
    for i in range(2):
        goal = min(max(commanded[1 + i], -limit), limit)
        pace = min(max(position_gain * (goal - angle[i]), -rate_limit), rate_limit)
        torque = rate_gain * (pace - rate[i])
        applied[i] = min(max(torque, -strongest), strongest)
        saturated[i] = 1.0 if goal != commanded[1 + i] or applied[i] != torque else 0.0
