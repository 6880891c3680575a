"""Reaction-control thrusters: valves with a delay and a least pulse, thrust with a lag, a tank."""

from dataclasses import dataclass
from math import ceil
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import model_validator

from mjspace.actuators import tank as tanks
from mjspace.actuators.base import (
    Actuator,
    Context,
    Fields,
    Input,
    State,
    motors,
)
from mjspace.actuators.thruster_layout import ThrusterTable, names
from mjspace.contract import Array, Measurement
from mjspace.environment.constants import STANDARD_GRAVITY
from mjspace.gufunc import gufunc
from mjspace.scenario.fields import Each, EachNonNegative, Positive, Si

FIELDS = ("rcs_thrust", "rcs_open", "rcs_on_time", "rcs_asked", "rcs_step", "rcs_propellant")
_ROUNDING = 1e-12
"""s: pulses that are closer than this are one."""
_HYDRAZINE = 1010.0  # kg/m^3 at 20 deg C


class Rcs(ThrusterTable):
    """On/off thrusters, one for each row of ``positions``.

    They are alike but for what is a list with a number for each. Their command is an ``on_time``
    for each, from the beginning of the control period. Propellant is in a spherical tank at the
    body origin, full of hydrazine at first; it loses mass and keeps its size.
    """

    each: ClassVar[tuple[str, ...]] = (
        *ThrusterTable.each,
        *("delay", "rise", "specific_impulse"),
    )

    delay: Annotated[EachNonNegative, Si("s")] = 0.0
    """From the command to the valve, for opening and closing alike."""
    rise: Annotated[EachNonNegative, Si("s")] = 0.0
    """Time constant with which the thrust follows its valve."""
    specific_impulse: Annotated[Each, Si("s")] | None = None
    """Thrust over the weight of the propellant's flow, on Earth; burns nothing when left out."""
    propellant: Annotated[Positive, Si("kg")] | None = None
    """In the tank at the start; goes with ``specific_impulse``."""

    @model_validator(mode="after")
    def _both_or_neither(self) -> "Rcs":
        if (self.specific_impulse is None) != (self.propellant is None):
            raise ValueError("specific_impulse and propellant: give both or neither")
        return self

    def attach(self, spec: Any) -> None:
        """Add the thrusters and the tank."""
        super().attach(spec)
        if self.propellant is not None:
            radius = np.cbrt(self.propellant / (4.0 / 3.0 * np.pi * _HYDRAZINE))
            tanks.add_sphere(spec, "rcs_tank", self.propellant, radius)

    def actuator(self, context: Context) -> "Thrusters":
        """Return the thrusters of a vehicle that was composed with them."""
        rates = context.rates
        period, steps = (rates.physics, 1) if context.inner else (rates.control, rates.steps)
        flow, tank, full = np.zeros(len(self.positions)), 0, np.zeros(3)
        if self.specific_impulse is not None:
            model = context.vehicle.model
            flow = 1.0 / (self.of_each("specific_impulse") * STANDARD_GRAVITY)
            tank = model.body("rcs_tank").id
            full = model.body_inertia[tank] / self.propellant
        valve = [self.of_each(key) for key in ("minimum_on", "delay", "rise")]
        each = np.stack([self.of_each("thrust"), flow, *valve], axis=-1)
        memory = 1 + ceil(np.max(self.delay) / period - 1e-9)
        timing = np.array([period, float(steps), self.to_the_end])
        return Thrusters(each, timing, memory, tank, full, self.propellant or 0.0)


@dataclass(frozen=True)
class Thrusters(Actuator):
    """On/off thrusters that obey a ``PulseCommand``.

    A pulse begins a ``delay`` after its control period does, or the integration step for which an
    inner loop commands it; one that lasts its whole period joins the next, and what is longer is
    cut, or goes on into the next. A valve that has opened
    stays open for ``minimum_on``: a shorter command is lengthened and not dropped. Each integration
    step has the impulse that valve and lag give it, exactly.
    """

    each: Array
    """Thrust [N], flow of propellant for each newton [kg/s/N], least on-time, delay and time
    constant [s] of each thruster, shape (n, 5)."""
    timing: Array
    """How long a command holds [s], of how many integration steps that is, and whether a burn may
    be longer (1.0), shape (3,)."""
    memory: int
    """How many commands may still be on their way to the valves."""
    tank: int
    """The body whose mass is the propellant's; 0: none burns."""
    full: Array
    """Principal moments [kg m^2] of that body for each kilogram in it, shape (3,)."""
    propellant: float
    """At the start [kg]."""

    logged_as: ClassVar[str] = "thruster_thrust"
    unit: ClassVar[str] = "N"
    measures: ClassVar[dict[str, str]] = {"thrust": "N", "propellant": "kg"}
    stateful: ClassVar[bool] = True

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.each)

    @property
    def drives(self) -> Input:
        """Its motors."""
        return motors(names(self.count))

    @property
    def takes(self) -> Fields:
        """The fields of a command."""
        return {"on_time": (self.count, "s")}

    def reset(self, vehicles: int) -> State:
        """Return closed valves and a full tank.

        The fields: "rcs_thrust" [N], "rcs_open" [s] (for how long each valve has been open, zero
        for a closed one) and "rcs_on_time" [s] (how long it has been since the start), each (N, n);
        "rcs_asked" [s], (N, n, periods), the newest on-times first, each at least what was left of
        the one before where burns go on; "rcs_step" (N, 1), integration steps since the control
        period began; "rcs_propellant" [kg], (N, 1).
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
        """Return on-times from none to the whole period of a command; any where burns go on."""
        if self.timing[2]:
            return super().limits()
        return {"on_time": (np.zeros(self.count), np.full(self.count, self.timing[0]))}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, mean thrust [N], saturated), (N, n).

        A thruster is saturated when its on-time is no part of the control period, where it has to
        be one, or shorter than the least pulse, or when its tank is empty.
        """
        before = (state[name] for name in FIELDS)
        *after, mean, saturated = _pulse.ufunc(
            *before, command.on_time, self.each, self.timing, step
        )
        return dict(zip(FIELDS, after, strict=True)), mean, saturated

    def measured(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with thrust and what is left in the tank, an engine's before them."""
        thrust = np.concatenate([truth.thrust, state["rcs_thrust"]], axis=-1)
        if not self.tank:
            return truth._replace(thrust=thrust)
        left = np.concatenate([truth.propellant, state["rcs_propellant"]], axis=-1)
        return truth._replace(thrust=thrust, propellant=left)

    def account(
        self, state: State, applied: Array, instead: Array, step: float
    ) -> tuple[State, Array]:
        """Return (state, thrust) where faults have made ``instead`` of what ``act`` applied.

        What is fired is burnt, and an empty tank fires nothing.
        """
        left, flow = state["rcs_propellant"], self.each[:, 1]
        if self.tank:
            instead = np.where(left > 0.0, instead, 0.0)
            # In units of the first's flow, which is exact for thrusters that are alike.
            more = flow / flow[0] * (instead - applied)
            burnt = flow[0] * step * np.sum(more, axis=-1, keepdims=True)
            state = state | {"rcs_propellant": np.maximum(left - burnt, 0.0)}
        return state, instead

    def masses(self, before: State, after: State) -> dict[str, tuple[int, Array]]:
        """Return mass and inertia of the tank."""
        if not self.tank:
            return {}
        propellant = before["rcs_propellant"], after["rcs_propellant"]
        return tanks.masses(self.tank, self.full, *propellant)


@gufunc(
    [
        "void(f8[:],f8[:],f8[:],f8[:,:],f8[:],f8[:],f8[:],f8[:,:],f8[:],f8,"
        "f8[:],f8[:],f8[:],f8[:,:],f8[:],f8[:],f8[:],f8[:])"
    ],
    "(n),(n),(n),(n,k),(o),(o),(n),(n,d),(p),()->(n),(n),(n),(n,k),(o),(o),(n),(n)",
)
def _pulse(
    thrust: Any,
    opened: Any,
    on_time: Any,
    commanded: Any,
    count: Any,
    tank: Any,
    command: Any,
    each: Any,
    timing: Any,
    step: Any,
    thrust_after: Any,
    opened_after: Any,
    on_time_after: Any,
    commanded_after: Any,
    count_after: Any,
    tank_after: Any,
    mean: Any,
    saturated: Any,
) -> None:
    """Advance valves, thrust and tank by ``step`` [s]; compute each thruster's mean thrust [N]."""
    period, steps, to_the_end = timing
    elapsed = count[0] * step
    burnt = 0.0
    for i in range(thrust.size):
        force, flow, least, delay, lag = each[i]
        dry = flow > 0.0 and tank[0] <= 0.0
        commanded_after[i] = commanded[i]
        if count[0] == 0.0:
            commanded_after[i, 1:] = commanded[i, :-1]
            newest = min(max(command[i], 0.0), period)
            if to_the_end > 0.0:
                left = commanded[i, 0] - period if command[i] >= 0.0 else 0.0
                newest = max(command[i], left, 0.0)
            commanded_after[i, 0] = newest
        # Of burns that go on, a shorter command than what is left has no effect.
        short = 0.0 < command[i] < least - _ROUNDING and commanded_after[i, 0] <= command[i]
        beyond = command[i] < 0.0 or command[i] > period + _ROUNDING
        beyond = beyond and to_the_end == 0.0
        saturated[i] = 1.0 if short or beyond or (dry and command[i] > 0.0) else 0.0

        now, impulse, open_for, on = 0.0, 0.0, opened[i], on_time[i]
        flowing = 0.0 if dry else thrust[i]
        while now < step - _ROUNDING:
            # Until when the valve is as it is at `now`.
            is_open, until = False, step
            for k in range(commanded.shape[1]):
                start = delay - elapsed - k * period
                stop = start + min(commanded_after[i, k], period)
                if start - _ROUNDING <= now < stop - _ROUNDING:
                    is_open = True
                    until = min(until, stop)
                elif start > now + _ROUNDING and commanded_after[i, k] > _ROUNDING:
                    until = min(until, start)
            held = not is_open and 0.0 < open_for < least - _ROUNDING
            if held:
                until = min(until, now + least - open_for)
            span = until - now
            target = force if (is_open or held) and not dry else 0.0
            share = np.exp(-span / lag) if lag > 0.0 else 0.0
            impulse += target * span + (flowing - target) * (1.0 - share) * lag
            flowing = target + (flowing - target) * share
            if is_open or held:
                open_for += span
                on += span
            else:
                open_for = 0.0
            now = until
        thrust_after[i], opened_after[i], on_time_after[i] = flowing, open_for, on
        mean[i] = impulse / step
        burnt += flow * impulse
    if burnt > tank[0]:
        mean *= tank[0] / burnt  # the tank runs dry within the step
    tank_after[0] = max(tank[0] - burnt, 0.0)
    count_after[0] = 0.0 if count[0] + 1.0 >= steps else count[0] + 1.0
