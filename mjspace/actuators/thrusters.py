"""Reaction-control thrusters: valves with a delay and a least pulse, thrust with a lag, a tank."""

from dataclasses import dataclass
from math import ceil
from typing import Any, ClassVar, Self

import numpy as np
from numba import guvectorize

from mjspace.actuators.base import Fields, State
from mjspace.actuators.engine import DRY
from mjspace.constants import STANDARD_GRAVITY
from mjspace.contract import Array, Measurement
from mjspace.scenario.plant import Rates
from mjspace.scenario.thrusters import Rcs
from mjspace.vehicle.vehicle import Vehicle

FIELDS = ("rcs_thrust", "rcs_open", "rcs_on_time", "rcs_asked", "rcs_step", "rcs_propellant")
_ROUNDING = 1e-12
"""s: pulses that are closer than this are one."""


@dataclass(frozen=True)
class Thrusters:
    """On/off thrusters that obey a ``PulseCommand``.

    A pulse begins a ``delay`` after its control period does, or the integration step for which an
    inner loop commands it; one that lasts its whole period joins the next. A valve that has opened
    stays open for ``minimum_on``: a shorter command is lengthened and not dropped. Each integration
    step has the impulse that valve and lag give it, exactly.
    """

    data: Array
    """The thrusters' numbers, in the order that the kernel reads them."""
    count: int
    memory: int
    """How many commands may still be on their way to the valves."""
    tank: int
    """The body whose mass is the propellant's; 0: none burns."""
    full: Array
    """Principal moments [kg m^2] of that body for each kilogram in it, shape (3,)."""
    propellant: float
    """At the start [kg]."""

    logged_as: ClassVar[str] = "thruster_thrust"
    acts_on: ClassVar[str] = "ctrl"
    stateful: ClassVar[bool] = True

    @classmethod
    def of(cls, vehicle: Vehicle, table: Rcs, rates: Rates, *, inner: bool = False) -> Self:
        """Return the thrusters of a vehicle that was composed with them.

        With ``inner`` the law's inner loop commands them, anew in every integration step.
        """
        period, steps = (rates.physics, 1) if inner else (rates.control, rates.steps)
        flow, tank, full = 0.0, 0, np.zeros(3)
        if table.specific_impulse is not None:
            flow = 1.0 / (table.specific_impulse * STANDARD_GRAVITY)
            tank = vehicle.model.body("rcs_tank").id
            full = vehicle.model.body_inertia[tank] / table.propellant
        valve = [table.minimum_on, table.delay, table.rise]
        data = np.array([table.thrust, flow, *valve, period, float(steps)])
        memory = 1 + ceil(table.delay / period - 1e-9)
        return cls(data, len(table.positions), memory, tank, full, table.propellant or 0.0)

    @property
    def takes(self) -> Fields:
        """The fields of a command."""
        return {"on_time": (self.count, "s")}

    def reset(self, vehicles: int) -> State:
        """Return closed valves and a full tank.

        The fields: "rcs_thrust" [N], "rcs_open" [s] (for how long each valve has been open, zero
        for a closed one) and "rcs_on_time" [s] (how long it has been since the start), each (N, n);
        "rcs_asked" [s], (N, n, periods), the newest on-times first; "rcs_step" (N, 1), integration
        steps since the control period began; "rcs_propellant" [kg], (N, 1).
        """
        none = np.zeros((vehicles, self.count))
        return {
            "rcs_thrust": none,
            "rcs_open": none,
            "rcs_on_time": none,
            "rcs_asked": np.zeros((vehicles, self.count, self.memory)),
            "rcs_step": np.zeros((vehicles, 1)),
            "rcs_propellant": np.full((vehicles, 1), self.propellant),
        }

    def limits(self) -> dict[str, tuple[Array, Array]]:
        """Return on-times from none to the whole period of a command."""
        return {"on_time": (np.zeros(self.count), np.full(self.count, self.data[5]))}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, mean thrust [N], whether each does otherwise than told), (N, n).

        A thruster does when its on-time is no part of the control period, or shorter than the least
        pulse, or when its tank is empty.
        """
        asked = np.asarray(command.on_time, dtype=float)
        before = (state[name] for name in FIELDS)
        *after, mean, cut = _pulse.ufunc(*before, asked, self.data, step)
        return dict(zip(FIELDS, after, strict=True)), mean, cut

    def seen(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with thrust and what is left in the tank, an engine's before them."""
        thrust = np.concatenate([truth.thrust, state["rcs_thrust"]], axis=-1)
        if not self.tank:
            return truth._replace(thrust=thrust)
        left = np.concatenate([truth.propellant, state["rcs_propellant"]], axis=-1)
        return truth._replace(thrust=thrust, propellant=left)

    def account_propellant(
        self, state: State, given: Array, instead: Array, step: float
    ) -> tuple[State, Array]:
        """Return (state, thrust) where faults have made ``instead`` of what ``act`` gave, (N, n).

        What is fired is burnt, and an empty tank fires nothing.
        """
        left, flow = state["rcs_propellant"], self.data[1]
        if flow:
            instead = np.where(left > 0.0, instead, 0.0)
            burnt = flow * step * np.sum(instead - given, axis=-1, keepdims=True)
            state = state | {"rcs_propellant": np.maximum(left - burnt, 0.0)}
        return state, instead

    def masses(self, before: State, after: State) -> dict[str, tuple[int, Array]]:
        """Return, of MuJoCo's model, the body and the values of each field that burning changes.

        They are those in the middle of the integration step that leads from ``before`` to
        ``after``: with them a constant thrust gives Tsiolkovsky's velocity to second order.
        """
        if not self.tank:
            return {}
        left = np.maximum(0.5 * (before["rcs_propellant"] + after["rcs_propellant"]), DRY)
        return {
            "body_mass": (self.tank, left[:, 0]),
            "body_inertia": (self.tank, left * self.full),
        }


@guvectorize(
    [
        "void(f8[:],f8[:],f8[:],f8[:,:],f8[:],f8[:],f8[:],f8[:],f8,"
        "f8[:],f8[:],f8[:],f8[:,:],f8[:],f8[:],f8[:],f8[:])"
    ],
    "(n),(n),(n),(n,k),(o),(o),(n),(d),()->(n),(n),(n),(n,k),(o),(o),(n),(n)",
    cache=True,
)
def _pulse(
    thrust: Any,
    opened: Any,
    on_time: Any,
    asked: Any,
    count: Any,
    tank: Any,
    command: Any,
    data: Any,
    step: Any,
    thrust_after: Any,
    opened_after: Any,
    on_time_after: Any,
    asked_after: Any,
    count_after: Any,
    tank_after: Any,
    mean: Any,
    cut: Any,
) -> None:
    """Advance valves, thrust and tank by ``step`` [s]; give each thruster's mean thrust [N]."""
    force, flow, least, delay, lag, period, steps = data
    dry = flow > 0.0 and tank[0] <= 0.0
    elapsed = count[0] * step
    burnt = 0.0
    for i in range(thrust.size):
        asked_after[i] = asked[i]
        if count[0] == 0.0:
            asked_after[i, 1:] = asked[i, :-1]
            asked_after[i, 0] = min(max(command[i], 0.0), period)
        short = 0.0 < command[i] < least - _ROUNDING
        beyond = command[i] < 0.0 or command[i] > period + _ROUNDING
        cut[i] = 1.0 if short or beyond or (dry and command[i] > 0.0) else 0.0

        now, impulse, open_for, on = 0.0, 0.0, opened[i], on_time[i]
        flowing = 0.0 if dry else thrust[i]
        while now < step - _ROUNDING:
            # Until when the valve is as it is at `now`.
            wanted, until = False, step
            for k in range(asked.shape[1]):
                start = delay - elapsed - k * period
                stop = start + asked_after[i, k]
                if start - _ROUNDING <= now < stop - _ROUNDING:
                    wanted = True
                    until = min(until, stop)
                elif start > now + _ROUNDING and asked_after[i, k] > _ROUNDING:
                    until = min(until, start)
            held = not wanted and 0.0 < open_for < least - _ROUNDING
            if held:
                until = min(until, now + least - open_for)
            span = until - now
            target = force if (wanted or held) and not dry else 0.0
            share = np.exp(-span / lag) if lag > 0.0 else 0.0
            impulse += target * span + (flowing - target) * (1.0 - share) * lag
            flowing = target + (flowing - target) * share
            if wanted or held:
                open_for += span
                on += span
            else:
                open_for = 0.0
            now = until
        thrust_after[i], opened_after[i], on_time_after[i] = flowing, open_for, on
        mean[i] = impulse / step
        burnt += flow * impulse
    if burnt > tank[0] and flow > 0.0:
        mean *= tank[0] / burnt  # the tank runs dry within the step
    tank_after[0] = max(tank[0] - burnt, 0.0)
    count_after[0] = 0.0 if count[0] + 1.0 >= steps else count[0] + 1.0
