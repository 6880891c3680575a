"""Cold-gas thrusters without a regulator: thrust falls with the tank's pressure as gas is spent.

G. P. Sutton, O. Biblarz, "Rocket Propulsion Elements", 8th edition, 2010, chapter 3: a choked
nozzle lets pass a flow proportional to p / sqrt(T), (3-24), and thrusts with C_F A p, (3-31), p and
T the tank's. With x the share of the gas that is left, an ideal gas that expands as a polytrope of
exponent n has p / p0 = x^n and T / T0 = x^(n - 1), so that for u open valves

    x' = -u x^((n + 1)/2) F0 / (m0 c0),    F = F0 x^n,    c = c0 x^((n - 1)/2),

where F0 is the thrust and c0 = g0 Isp the exhaust speed with the full tank, of m0 kilograms. Where
thrusters differ, F0 and c0 are the first's, and one of thrust F and exhaust speed c counts as
(F / F0) (c0 / c) open valves. A step with a total opening of u t seconds has a closed form, used
here, for mass and impulse:

    x = exp(-u t F0 / (m0 c0))                                      (n = 1, isothermal)
    x^(-(n - 1)/2) = 1 + (n - 1)/2 u t F0 / (m0 c0)                 (n > 1)
    impulse = m0 c0 2/(n + 1) (1 - x^((n + 1)/2)).
"""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from mjspace.actuators import tank as tanks
from mjspace.actuators.base import Actuator, Context, Fields, Input, State, motors
from mjspace.actuators.thruster_layout import ThrusterTable, names
from mjspace.contract import Array, Measurement
from mjspace.environment.constants import STANDARD_GRAVITY
from mjspace.gufunc import gufunc
from mjspace.scenario.fields import Each, Positive, Si


class ColdGas(ThrusterTable):
    """On/off cold-gas thrusters on one tank; ``thrust`` is of a full tank.

    They are alike but for what is a list with a number for each. Their command is an ``on_time``
    for each, from the beginning of the control period. The gas fills a sphere at the body origin;
    its pressure falls as it is spent, and the thrust with it.
    """

    excludes: ClassVar[tuple[str, ...]] = ("rcs",)
    each: ClassVar[tuple[str, ...]] = (*ThrusterTable.each, "specific_impulse")

    specific_impulse: Annotated[Each, Si("s")]
    """Thrust over the weight of the gas's flow, on Earth, of a full tank."""
    gas: Annotated[Positive, Si("kg")]
    """In the tank at the start."""
    exponent: Annotated[Positive, Field(ge=1, le=5 / 3)] = 1.0
    """Of the polytrope that the gas in the tank follows: 1 where the tank keeps it at its
    temperature; its ratio of specific heats, 1.4 for nitrogen, where no heat reaches it."""
    tank_radius: Annotated[Positive, Si("m")] = 0.1
    """Of the sphere."""

    def attach(self, spec: Any) -> None:
        """Add the thrusters and the tank."""
        super().attach(spec)
        tanks.add_sphere(spec, "cold_gas_tank", self.gas, self.tank_radius)

    def actuator(self, context: Context) -> "ColdGasThrusters":
        """Return the thrusters of a vehicle that was composed with them."""
        rates, model = context.rates, context.vehicle.model
        period, steps = (rates.physics, 1) if context.inner else (rates.control, rates.steps)
        shortest = self.of_each("minimum_on")
        if (longest := shortest.max()) > period:
            raise ValueError(
                f"plant.cold_gas.minimum_on: {longest:g} s is longer than the {period:g} s "
                "for which a command holds: make it shorter"
            )
        tank = model.body("cold_gas_tank").id
        thrust, impulse = self.of_each("thrust"), self.of_each("specific_impulse")
        speed = impulse[0] * STANDARD_GRAVITY
        each = np.stack([thrust / thrust[0], impulse[0] / impulse, shortest], axis=-1)
        timing = [period, float(steps), self.to_the_end]
        data = np.array([thrust[0], speed, self.gas, self.exponent, *timing])
        return ColdGasThrusters(each, data, tank, model.body_inertia[tank] / self.gas)


@dataclass(frozen=True)
class ColdGasThrusters(Actuator):
    """On/off thrusters that obey a ``PulseCommand``, on a tank that blows down.

    A pulse begins with its control period, or with the integration step for which an inner loop
    commands it, and ends within it or, where burns go on, later. The impulse of each integration
    step is exact; thrusters that are open for different parts of a step share it by their times.
    """

    each: Array
    """Thrust and inverse exhaust speed, each over the first thruster's, and least on-time [s] of
    each thruster, shape (n, 3)."""
    data: Array
    """The first thruster's thrust and exhaust speed, and what is the same for all, as the kernel
    reads it."""
    tank: int
    """The body whose mass is the gas's."""
    full: Array
    """Principal moments [kg m^2] of that body for each kilogram in it, shape (3,)."""

    logged_as: ClassVar[str] = "thruster_thrust"
    unit: ClassVar[str] = "N"
    measures: ClassVar[dict[str, str]] = {"propellant": "kg"}
    stateful: ClassVar[bool] = True

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.each)

    @property
    def takes(self) -> Fields:
        """The on-time of each thruster."""
        return {"on_time": (self.count, "s")}

    @property
    def drives(self) -> Input:
        """Their motors."""
        return motors(names(self.count))

    def reset(self, vehicles: int) -> State:
        """Return a full tank: "cold_gas" [kg], and "cold_gas_step", steps in the period; (N, 1).

        Where burns go on, "cold_gas_on" (N, n) is for how long each was to be on when the control
        period began [s].
        """
        gas, step = np.full((vehicles, 1), self.data[2]), np.zeros((vehicles, 1))
        on = {"cold_gas_on": np.zeros((vehicles, self.count))} if self.data[-1] else {}
        return {"cold_gas": gas, "cold_gas_step": step, **on}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, mean thrust [N], saturated), (N, n).

        A thruster is saturated when its on-time is no part of the control period, where it has to
        be one, or shorter than the least pulse.
        """
        before = state["cold_gas"], state["cold_gas_step"]
        on = state.get("cold_gas_on", np.zeros(self.count))
        gas, count, on, mean, saturated = _blow_down.ufunc(
            command.on_time, *before, on, self.each, self.data, step
        )
        after = {"cold_gas": gas, "cold_gas_step": count}
        return after | ({"cold_gas_on": on} if self.data[-1] else {}), mean, saturated

    def measured(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with the gas that is left, after an engine's propellant."""
        left = np.concatenate([truth.propellant, state["cold_gas"]], axis=-1)
        return truth._replace(propellant=left)

    def masses(self, before: State, after: State) -> dict[str, tuple[int, Array]]:
        """Return mass and inertia of the tank."""
        return tanks.masses(self.tank, self.full, before["cold_gas"], after["cold_gas"])

    def account(
        self, state: State, applied: Array, instead: Array, step: float
    ) -> tuple[State, Array]:
        """Return (state, thrust) where faults have made ``instead`` of what ``act`` applied.

        The difference leaves with the exhaust speed of the moment, and an empty tank has no thrust.
        """
        left, (_, speed, full, exponent, *_) = state["cold_gas"], self.data
        instead = np.where(left > 0.0, instead, 0.0)
        exhaust = speed * (np.maximum(left, tanks.DRY) / full) ** (0.5 * (exponent - 1.0))
        more = self.each[:, 1] * (instead - applied)
        spent = np.sum(more, axis=-1, keepdims=True) * step / exhaust
        return state | {"cold_gas": np.maximum(left - spent, 0.0)}, instead


@gufunc(
    ["void(f8[:],f8[:],f8[:],f8[:],f8[:,:],f8[:],f8,f8[:],f8[:],f8[:],f8[:],f8[:])"],
    "(n),(o),(o),(n),(n,k),(d),()->(o),(o),(n),(n),(n)",
)
def _blow_down(
    on_time: Any,
    gas: Any,
    count: Any,
    on: Any,
    each: Any,
    data: Any,
    step: Any,
    gas_after: Any,
    count_after: Any,
    on_after: Any,
    mean: Any,
    saturated: Any,
) -> None:
    """Advance the tank by ``step`` [s]; compute each thruster's mean thrust [N]."""
    force, speed, full, exponent, period, steps, to_the_end = data
    total = 0.0  # time of valves like the first's that let pass as much
    for i in range(on_time.size):
        commanded, least = on_time[i], each[i, 2]
        short = 0.0 < commanded < least
        applied = least if short else max(commanded, 0.0)
        if to_the_end == 0.0:
            applied = min(applied, period)
        elif count[0] > 0.0:
            applied = on[i]
        elif commanded >= 0.0:
            applied = max(applied, on[i] - period)
        on_after[i] = applied
        opened = min(max(applied - count[0] * step, 0.0), step)
        mean[i] = each[i, 0] * opened
        total += each[i, 1] * mean[i]
        beyond = commanded < 0.0 or commanded > period + 1e-12
        short = short and applied <= least
        saturated[i] = 1.0 if short or (beyond and to_the_end == 0.0) else 0.0
    before, spent = gas[0] / full, total * force / (full * speed)
    half = 0.5 * (exponent - 1.0)
    # The logarithm of what is left: differences of powers would lose the digits of short pulses.
    fall = spent if half == 0.0 else np.log1p(half * spent * before**half) / half
    after = before * np.exp(-fall)
    share = -np.expm1(-(half + 1.0) * fall) / (half + 1.0)
    impulse = full * speed * before ** (half + 1.0) * share
    for i in range(on_time.size):
        mean[i] *= impulse / (total * step) if total > 0.0 else 0.0
    gas_after[0] = full * after
    count_after[0] = 0.0 if count[0] + 1.0 >= steps else count[0] + 1.0
