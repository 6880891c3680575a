"""Faults of actuators: what they give is changed on its way to the vehicle, from a moment on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mjspace.actuators.base import Actuators, State
from mjspace.actuators.thrusters import Thrusters
from mjspace.contract import TICK, Array, Event
from mjspace.errors import input_error_at, nearest
from mjspace.scenario.faults import Fault
from mjspace.sensors.noise import normals
from mjspace.signals import find_signal, magnitude
from mjspace.units import whole_number
from mjspace.vehicle.indices import is_thruster

STREAM = 1000
"""First number of the faults' random streams; the sensors' are hashes of their names."""
_WAITING, _IN_FORCE, _OVER = 0.0, 1.0, 2.0


@dataclass(frozen=True)
class _Place:
    """Where a fault's motors are in what the kinds of actuators give."""

    kind: int
    columns: list[int]


def between(tables: Sequence[Fault], control: float) -> bool:
    """Tell whether a fault begins or ends between control instants, ``control`` [s] apart."""
    times = [time for fault in tables for time in (fault.at, fault.until) if time is not None]
    return any(abs(time - control * round(time / control)) > TICK for time in times)


class FaultSet:
    """The faults of a batch of vehicles; all memory is in ``State``.

    A fault begins and ends with an integration step; one that looks at a signal begins with a
    control period. Of several on one motor, each changes what those listed before have left.
    """

    def __init__(
        self,
        tables: Sequence[Fault],
        kinds: Sequence[Actuators],
        motors: Sequence[str],
        hold: float,
        seed: int,
        members: Sequence[int],
    ) -> None:
        """Find the motors; ``hold`` [s] is how long what actuators give is held.

        Raises:
            ValueError: no such motor, or a delay that is no whole number of holds.
        """
        self._tables, self._kinds, self._hold = tables, kinds, hold
        self._vehicles = len(members)
        known = _places(kinds, motors)
        self._places, self._noises = [], []
        self._lengths = []  # of what is remembered of each
        for number, fault in enumerate(tables):
            if fault.motor not in known:
                raise ValueError(
                    f"faults.{number}.motor: none is called {fault.motor!r}"
                    f"{nearest(fault.motor, known)}"
                )
            place, length = known[fault.motor], int(fault.kind == "stuck")
            if fault.kind == "delayed" and fault.value:
                key = f"faults.{number}.value"
                length = whole_number(fault.value, hold, key, "what is held by actuators")
            self._places.append(place)
            self._lengths.append(length)
            width = len(place.columns)
            self._noises.append(normals(seed, members, (STREAM + number,), width))

    def reset(self) -> State:
        """Return the state at the start.

        Its fields: "fault_phase" (N, faults), 0 before each, 1 while it lasts and 2 after it; and
        "fault_<number>_past" (N, motors, k), what the motors of a delayed or stuck one would have
        given, the newest last.
        """
        state = {"fault_phase": np.full((self._vehicles, len(self._tables)), _WAITING)}
        for number, length in enumerate(self._lengths):
            if length:
                width = len(self._places[number].columns)
                state[f"fault_{number}_past"] = np.zeros((self._vehicles, width, length))
        return state

    def decide(
        self, state: State, now: float, seen: Mapping[str, Any] | None
    ) -> tuple[State, list[Event]]:
        """Return the state with what begins and ends at ``now`` [s], and the events of that.

        ``seen`` has the named tuples that a fault's ``when`` may look at, by topic; None between
        control instants, where none looks.

        Raises:
            InputError: a fault looks at a signal that is not there, with the near names.
        """
        phase = state["fault_phase"].copy()
        happened = []
        for number, fault in enumerate(self._tables):
            over = fault.until is not None and now >= fault.until - TICK
            ends = over & (phase[:, number] == _IN_FORCE)
            begins = ~np.bool_(over) & (phase[:, number] == _WAITING)
            begins &= self._is_due(number, now, seen)
            phase[ends, number], phase[begins, number] = _OVER, _IN_FORCE
            what = f"fault: {fault.motor} is {fault.kind}"
            happened += [Event(now, int(v), "WARNING", what) for v in np.flatnonzero(begins)]
            happened += [
                Event(now, int(v), "INFO", f"{what} no more") for v in np.flatnonzero(ends)
            ]
        return state | {"fault_phase": phase}, happened

    def change(
        self, state: State, given: tuple[Array, ...], now: float
    ) -> tuple[State, tuple[Array, ...]]:
        """Return (state, what the motors give instead of ``given``) from ``now`` [s] on."""
        state, result = state.copy(), list(given)
        for number, place in enumerate(self._places):
            right = result[place.kind][:, place.columns]
            field = f"fault_{number}_past"
            past = state.get(field)
            index = round(now / self._hold)
            wrong = self._wrong(number, right, past, index)
            in_force = state["fault_phase"][:, number] == _IN_FORCE
            if past is not None:
                newest = np.concatenate([past[..., 1:], right[..., None]], axis=-1)
                keeps = in_force & (self._tables[number].kind == "stuck")
                state[field] = np.where(keeps[:, None, None], past, newest)
            changed = result[place.kind].copy()
            changed[:, place.columns] = np.where(in_force[:, None], wrong, right)
            result[place.kind] = changed
        for number, kind in enumerate(self._kinds):
            if hasattr(kind, "account_propellant"):
                state, result[number] = kind.account_propellant(
                    state, given[number], result[number], self._hold
                )
        return state, tuple(result)

    def _wrong(self, number: int, right: Array, past: Array | None, index: int) -> Array:
        """Return what the fault's motors give where it is in force, (N, motors)."""
        kind, value = self._tables[number].kind, self._tables[number].value or 0.0
        if past is not None:
            return past[..., 0]
        if kind == "noisy":
            return right + value * self._noises[number](index)
        return right + value if kind == "biased" else right * value  # of a dead one by zero

    def _is_due(self, number: int, now: float, seen: Mapping[str, Any] | None) -> Any:
        fault = self._tables[number]
        if fault.at is not None:
            return now >= fault.at - TICK
        if fault.when is None or seen is None:
            return np.bool_(False)
        arrays = {
            f"/{topic}": {n: np.asarray(a) for n, a in values._asdict().items() if np.size(a)}
            for topic, values in seen.items()
            if values
        }
        topics = {t: {n: a.shape[1:] for n, a in fields.items()} for t, fields in arrays.items()}
        with input_error_at(f"faults.{number}.when.signal"):
            topic, field, part = find_signal(topics, fault.when.signal)
        rows = arrays[topic][field].reshape(self._vehicles, -1)
        return fault.when.admits(magnitude(rows[:, part]))


def _places(kinds: Sequence[Actuators], motors: Sequence[str]) -> dict[str, _Place]:
    """Return the motors by each name that they have."""
    pushing = [name for name in motors if is_thruster(name)]
    turning = [name for name in motors if not is_thruster(name)]
    known = {}
    for number, kind in enumerate(kinds):
        names = pushing if isinstance(kind, Thrusters) else turning
        if kind.acts_on != "ctrl":
            names = [""] * 3  # of a torque or moment on the bus: its axes
        for column, name in enumerate(names):
            known[name] = known[f"{kind.logged_as}[{column}]"] = _Place(number, [column])
        known[kind.logged_as] = _Place(number, list(range(len(names))))
    return {name: place for name, place in known.items() if name}
