"""What reaction wheels cost: their electrical power and energy, and torques within a limit of it.

A motor of torque T on a rotor of speed w relative to the bus has the mechanical power T w. While
it drives, T w > 0, it takes T w / e, e the efficiency of motor and drive; while it brakes it gives
back e T w, or nothing where the drive does not regenerate. Its winding heats by (T / k)^2 R, k the
torque constant and R its resistance, and its electronics take a constant power besides.
"""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from mjspace.actuators.base import State
from mjspace.contract import Array
from mjspace.scenario.fields import (
    Each,
    EachNonNegative,
    OneOrEach,
    Positive,
    Si,
    Switch,
    Table,
    of_each,
)

_TINY = 1e-300
"""In place of a divisor of zero, for a torque or a share that is as good as unlimited."""

Efficiency = Annotated[float, Field(gt=0, le=1, strict=True, allow_inf_nan=False)]


class PowerKeys(Table):
    """What a wheel's motor and drive take from the bus; nothing of it is computed by default."""

    efficiency: Annotated[float | list[Efficiency], OneOrEach(Efficiency)] | None = None
    """Of motor and drive: mechanical over electrical power while a wheel speeds up. With it the log
    has ``truth.wheel_power`` and ``truth.wheel_energy``; none is computed when left out."""
    regenerates: Switch = False
    """Whether a wheel that slows down gives its power, times ``efficiency``, back to the bus."""
    standby_power: Annotated[EachNonNegative, Si("W")] = 0.0
    """Constant power of a wheel's electronics."""
    torque_constant: Annotated[Each, Si("N m/A")] | None = None
    """Of the motor; with ``winding_resistance`` for the heat of its winding, (T / k)^2 R. Where a
    data sheet has the motor constant [N m/sqrt(W)], that is k with R = 1 ohm."""
    winding_resistance: Annotated[Each, Si("ohm")] | None = None
    """Of the motor's winding; goes with ``torque_constant``."""
    power_limit: Annotated[Each, Si("W")] | None = None
    """Largest electrical power of a wheel: its torque is cut so that it stays within until the end
    of the integration step; none when left out."""
    total_power_limit: Annotated[Positive, Si("W")] | None = None
    """Largest electrical power of all together: all torques are scaled alike; none when left
    out."""

    @model_validator(mode="after")
    def _power(self) -> "PowerKeys":
        if self.efficiency is None:
            for key in PowerKeys.model_fields:
                if getattr(self, key) != PowerKeys.model_fields[key].default:
                    raise ValueError(f"{key}: goes with efficiency, which is missing")
        if (self.torque_constant is None) != (self.winding_resistance is None):
            raise ValueError("torque_constant and winding_resistance: give both or neither")
        return self

    def power_model(self, inertia: Array) -> "PowerModel | None":
        """Return the power of wheels of that ``inertia`` against the bus (n,); None: not asked for.

        Raises:
            ValueError: a limit leaves no power for any torque.
        """
        if self.efficiency is None:
            return None
        count = len(inertia)
        efficiency, standby = of_each(self.efficiency, count), of_each(self.standby_power, count)
        copper = np.zeros(count)
        if self.torque_constant is not None and self.winding_resistance is not None:
            constant = of_each(self.torque_constant, count)
            copper = of_each(self.winding_resistance, count) / constant**2
        limit = None if self.power_limit is None else of_each(self.power_limit, count)
        if limit is not None and (limit <= standby).any():
            least = int(np.argmin(limit - standby))
            raise ValueError(_no_room("power_limit", limit[least], standby[least]))
        total = self.total_power_limit
        if total is not None and total <= standby.sum():
            raise ValueError(_no_room("total_power_limit", total, standby.sum()))
        recovered = efficiency if self.regenerates else np.zeros(count)
        return PowerModel(efficiency, recovered, standby, copper, inertia, limit, total)


def _no_room(key: str, limit: float, standby: float) -> str:
    return f"{key}: {limit:g} W is not above the {standby:g} W of standby_power: give more"


@dataclass(frozen=True)
class PowerModel:
    """The electrical side of n wheels; torques [N m] and speeds [rad/s] are (..., n)."""

    efficiency: Array
    """Mechanical over electrical power of a wheel that drives, (n,)."""
    recovered: Array
    """Share of its mechanical power that one gives back that brakes, (n,)."""
    standby: Array
    """[W], (n,)."""
    copper: Array
    """Heat of the winding for each squared torque [W/(N m)^2], (n,)."""
    inertia: Array
    """Torque of a motor over the relative acceleration of its rotor [kg m^2], (n,)."""
    limit: Array | None
    """Largest electrical power of each [W], (n,)."""
    total_limit: float | None
    """Largest of all together [W]."""

    def reset(self, vehicles: int) -> State:
        """Return what it takes to add up energy, from the start on.

        "wheel_energy" [J] is until the last integration step began, (N, n); in that step the motors
        had "wheel_held_torque" [N m], the rotors "wheel_held_speed" [rad/s] at first, each (N, n),
        and it took "wheel_held_for" [s], (N, 1).
        """
        none = np.zeros((vehicles, len(self.inertia)))
        held = {"wheel_held_torque": none, "wheel_held_speed": none}
        return {"wheel_energy": none, **held, "wheel_held_for": np.zeros((vehicles, 1))}

    def drive(self, state: State, torque: Array, speed: Array, step: float) -> tuple[State, Array]:
        """Return (state, torque [N m] within the limits) for a ``step`` [s] from now."""
        _, energy = self.used(state, speed)
        within = self.within_limits(torque, speed, step)
        held = {"wheel_held_torque": within, "wheel_held_speed": 1.0 * speed}  # no view
        return {
            "wheel_energy": energy,
            **held,
            "wheel_held_for": step + 0.0 * energy[..., :1],
        }, within

    def used(self, state: State, speed: Array) -> tuple[Array, Array]:
        """Return power [W] and energy [J] of each, now that the rotors have this ``speed``."""
        torque, before = state["wheel_held_torque"], state["wheel_held_speed"]
        since = self.energy(torque, before, speed, state["wheel_held_for"])
        return self.power(torque, speed), state["wheel_energy"] + since

    def account(self, state: State, torque: Array) -> State:
        """Return the state where faults have made this ``torque`` of what was to be applied."""
        return state | {"wheel_held_torque": torque}

    def power(self, torque: Array, speed: Array) -> Array:
        """Return the electrical power of each [W]; negative where it gives more than it takes."""
        shaft = self._electrical(torque * speed)
        taken: Array = self.standby + self.copper * torque * torque + shaft
        return taken

    def energy(self, torque: Array, before: Array, after: Array, duration: Any) -> Array:
        """Return the electrical energy [J] of a ``duration`` [s] at a constant ``torque``.

        The speed goes from ``before`` to ``after`` linearly, as at constant torque it nearly does:
        the error is of second order in the integration step.
        """
        first, last = torque * before, torque * after
        # Where a rotor passes zero, it brakes for one part of the time and drives for the other.
        turns = first * last < 0.0
        braked = np.where(turns, first / np.where(turns, first - last, 1.0), 1.0)
        driven = np.where(turns, 1.0 - braked, 1.0)
        shaft = 0.5 * (braked * self._electrical(first) + driven * self._electrical(last))
        used: Array = duration * (self.standby + self.copper * torque * torque + shaft)
        return used

    def within_limits(self, torque: Array, speed: Array, step: float) -> Array:
        """Return the torques, cut so that power stays within the limits for a ``step`` [s].

        A wheel's own power is limited first, then that of all: by one factor for all torques, so
        that their sum keeps its direction. Power is largest at the end of the step, at the speed
        that the torque has made by then; what else turns the bus is not foreseen.
        """
        along, gained = np.copysign(1.0, torque) * speed, step / self.inertia
        if self.limit is not None:
            room, most = self.limit - self.standby, np.inf
            # Of the two laws for driving and for braking that which applies has the larger power.
            for share in (1.0 / self.efficiency, self.recovered):
                square = share * gained + self.copper
                most = np.minimum(most, _largest(square, share * along, room))
            torque = np.copysign(np.minimum(np.abs(torque), most), torque)
        if self.total_limit is not None:
            size = np.abs(torque)
            # A rotor that reverses in the step brakes first: the larger term of either is used.
            driving, braking = 1.0 / self.efficiency, self.recovered
            share = np.where(along + gained * size > 0.0, driving, braking)
            square = (share * gained + self.copper) * size * size
            linear = np.where(along > 0.0, driving, braking) * along * size
            both = np.sum(square, axis=-1, keepdims=True), np.sum(linear, axis=-1, keepdims=True)
            room = self.total_limit - self.standby.sum()
            torque = np.minimum(_largest(both[0], both[1], room), 1.0) * torque
        return torque

    def _electrical(self, shaft: Array) -> Array:
        """Return the electrical for the mechanical power [W], without what is lost besides."""
        electrical: Array = np.where(shaft > 0.0, shaft / self.efficiency, self.recovered * shaft)
        return electrical


def _largest(square: Any, linear: Any, room: Any) -> Any:
    """Return the largest x with square x^2 + linear x <= room, for square >= 0 and room > 0."""
    root = np.sqrt(linear * linear + 4.0 * square * room)
    # Of the two forms of the root that which adds up what has one sign.
    rising = 2.0 * room / np.maximum(linear + root, _TINY)
    falling = (root - linear) / np.maximum(2.0 * square, _TINY)
    return np.where(linear >= 0.0, rising, falling)
