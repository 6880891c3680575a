"""An engine on two gimbals, as a vehicle's actuators: throttle, servos, propellant."""

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numba import guvectorize

from mjspace.actuators.base import Fields, State
from mjspace.constants import STANDARD_GRAVITY
from mjspace.contract import TICK, Array, Measurement
from mjspace.scenario.landing import Engine
from mjspace.vehicle.vehicle import Vehicle

DRY = 1e-6
"""kg left in a tank that is empty: a body with none would have no inertia."""
FIELDS = ("thrust", "propellant", "burning", "clock")


@dataclass(frozen=True)
class GimballedEngine:
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
    takes: ClassVar[Fields] = {"thrust": (1, "N"), "gimbal": (2, "rad")}
    acts_on: ClassVar[str] = "ctrl"
    stateful: ClassVar[bool] = True

    @classmethod
    def of(
        cls, vehicle: Vehicle, table: Engine, *, gravity: float = 0.0, thrust: float | None = None
    ) -> Self:
        """Return the engine of a vehicle that has one, and a body called ``tank``.

        It burns at the start with ``thrust`` [N], by default at trim: it holds the vehicle's weight
        in ``gravity`` [m/s^2] as far as its throttle goes; without gravity it is cold.
        """
        model = vehicle.model
        tank = model.body("tank").id
        flow = 0.0
        if table.specific_impulse is not None:
            flow = 1.0 / (table.specific_impulse * STANDARD_GRAVITY)
        data = [
            table.thrust_min,
            table.thrust_max,
            table.thrust_lag,
            flow,
            table.gimbal_limit,
            np.inf if table.gimbal_rate_limit is None else table.gimbal_rate_limit,
            1.0 / table.gimbal_lag,
            table.gimbal_rate_gain,
            np.inf if table.fails_at is None else table.fails_at,
            table.gimbal_torque_limit,
        ]
        held = float(model.body_mass[tank])
        propellant = held if table.propellant is None else table.propellant
        if thrust is None:
            weight = (float(np.sum(model.body_mass)) - held + propellant) * gravity
            thrust = float(np.clip(weight, table.thrust_min, table.thrust_max)) if weight else 0.0
        return cls(
            np.array(data),
            tank if flow else 0,
            model.body_inertia[tank] / held,
            propellant,
            thrust,
        )

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
        """Return (state, [outer torque, inner torque, thrust], whether each is cut), (N, 3)."""
        packed = np.concatenate([state[name] for name in FIELDS], axis=-1)
        wanted = np.concatenate([command.thrust, command.gimbal], axis=-1)
        after, acting, cut = _engine.ufunc(
            packed, wanted, truth.gimbal_angle, truth.gimbal_rate, self.data, step
        )
        return {name: after[:, i : i + 1] for i, name in enumerate(FIELDS)}, acting, cut

    def seen(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with thrust and what is left in the tank."""
        return truth._replace(thrust=state["thrust"], propellant=state["propellant"])

    def masses(self, before: State, after: State) -> dict[str, tuple[int, Array]]:
        """Return, of MuJoCo's model, the body and the values of each field that burning changes.

        They are those in the middle of the integration step that leads from ``before`` to
        ``after``: with them a constant thrust gives Tsiolkovsky's velocity to second order.
        """
        if not self.tank:
            return {}
        left = np.maximum(0.5 * (before["propellant"] + after["propellant"]), DRY)
        return {
            "body_mass": (self.tank, left[:, 0]),
            "body_inertia": (self.tank, left * self.full),
        }


@guvectorize(
    ["void(f8[:],f8[:],f8[:],f8[:],f8[:],f8,f8[:],f8[:],f8[:])"],
    "(s),(c),(g),(g),(d),()->(s),(c),(c)",
    cache=True,
)
def _engine(
    state: Any,
    wanted: Any,
    angle: Any,
    rate: Any,
    data: Any,
    step: Any,
    after: Any,
    acting: Any,
    cut: Any,
) -> None:
    """Advance thrust, tank and clock by ``step`` [s]; give the torques and the mean thrust."""
    least, most, lag, flow, limit, rate_limit, position_gain, rate_gain, fails_at, strongest = data
    thrust, left, burning, clock = state
    # What is asked of an engine that is out stays unheard: it does not start twice.
    if wanted[0] <= 0.0 or clock >= fails_at - TICK or left <= 0.0:
        burning = 0.0
    target = burning * min(max(wanted[0], least), most)
    if burning == 0.0:
        thrust = 0.0  # the valves shut at once
    share = np.exp(-step / lag) if lag > 0.0 else 0.0
    ahead = target + (thrust - target) * share
    mean = target + (thrust - target) * (1.0 - share) * lag / step
    after[0], after[1] = ahead, max(left - flow * mean * step, 0.0)
    after[2], after[3] = burning, clock + step
    acting[2], cut[2] = mean, 1.0 if burning > 0.0 and target != wanted[0] else 0.0
    for i in range(2):
        goal = min(max(wanted[1 + i], -limit), limit)
        pace = min(max(position_gain * (goal - angle[i]), -rate_limit), rate_limit)
        torque = rate_gain * (pace - rate[i])
        acting[i] = min(max(torque, -strongest), strongest)
        cut[i] = 1.0 if goal != wanted[1 + i] or acting[i] != torque else 0.0
