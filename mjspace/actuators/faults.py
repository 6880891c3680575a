"""Faults of actuators: what they apply is changed on its way to the vehicle, from a moment on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from mjspace.actuators.base import Actuator, State
from mjspace.actuators.fault_kinds import KINDS
from mjspace.contract import TICK, Array, Event
from mjspace.errors import input_error_at, nearest
from mjspace.scenario.fields import Finite, Seconds, Table, Time
from mjspace.scenario.region import Region
from mjspace.sensors.noise import normals
from mjspace.signals import find_signal, magnitude
from mjspace.units import to_si

STREAM = 1000
"""First number of the faults' random streams; the sensors' are hashes of their names."""
_WAITING, _IN_FORCE, _OVER = 0.0, 1.0, 2.0
_WITH_VALUE = [name for name, kind in KINDS.items() if kind.has_value]


class Fault(Table):
    """From a moment on a motor does not apply what its model says; the log mentions when."""

    motor: str
    """Its name, ``wheel_0`` or ``thruster_3``; or all of a kind, or one of them, as /command has
    them: ``thruster_thrust``, ``thruster_thrust[3]``, ``magnetic_moment[2]``."""
    kind: Literal[*KINDS] = Field(  # type: ignore[valid-type]
        description="It applies: "
        + "; ".join(f"{name}, {kind.applies}" for name, kind in KINDS.items())
        + "."
    )
    value: Finite | None = Field(
        default=None, description=f"Of {', '.join(_WITH_VALUE)}; a number in SI or a quantity."
    )
    at: Time | None = None
    """When it begins: at the first integration step that is not before."""
    when: Region | None = None
    """Or the first control period in which a signal is inside: one of ``truth`` as ideal sensors
    measure it, ``measurement``, ``command`` or ``law``."""
    until: Seconds | None = None
    """When it is over; never when left out."""

    @field_validator("value", mode="before")
    @classmethod
    def _quantity(cls, value: Any) -> Any:
        return to_si(value, None)

    @model_validator(mode="after")
    def _consistent(self) -> "Fault":
        kind = KINDS[self.kind]
        if (self.value is not None) != kind.has_value:
            has = "one: give it" if kind.has_value else "none"
            raise ValueError(f"value: a motor that is {self.kind} has {has}")
        if (self.at is None) == (self.when is None):
            raise ValueError("at and when: give one of them")
        if self.at is not None and self.until is not None and self.until <= self.at:
            raise ValueError(f"until {self.until:g} s is not after at {self.at:g} s")
        if kind.is_positive and not (self.value or 0.0) > 0.0:
            raise ValueError(f"value {self.value:g} of one that is {self.kind}: more than 0")
        return self


@dataclass(frozen=True)
class _Place:
    """Where a fault's motors are in what the kinds of actuators apply."""

    kind: int
    columns: slice

    @property
    def width(self) -> int:
        """How many motors they are."""
        return self.columns.stop - self.columns.start  # type: ignore[no-any-return]


def between(tables: Sequence[Fault], control: float) -> bool:
    """Tell whether a fault begins or ends between control instants, ``control`` [s] apart."""
    times = [time for fault in tables for time in (fault.at, fault.until) if time is not None]
    return any(abs(time - control * round(time / control)) > TICK for time in times)


class FaultSet:
    """The faults of a batch of vehicles; all memory is in ``State``.

    A fault begins and ends with an integration step; one that depends on a signal begins with a
    control period. Of several on one motor, each changes what those listed before it apply.
    """

    def __init__(
        self,
        tables: Sequence[Fault],
        kinds: Sequence[Actuator],
        hold: float,
        seed: int,
        members: Sequence[int],
    ) -> None:
        """Find the motors; ``hold`` [s] is how long what actuators apply is held.

        Raises:
            ValueError: no such motor, or a delay that is no whole number of holds.
        """
        self._tables, self._kinds, self._hold = tables, kinds, hold
        self._vehicles = len(members)
        known = _places(kinds)
        self._places, self._noises = [], []
        self._lengths = []  # of what is remembered of each
        for number, fault in enumerate(tables):
            if fault.motor not in known:
                raise ValueError(
                    f"faults.{number}.motor: none is called {fault.motor!r}"
                    f"{nearest(fault.motor, known)}"
                )
            place, key = known[fault.motor], f"faults.{number}.value"
            self._places.append(place)
            self._lengths.append(KINDS[fault.kind].memory(fault.value or 0.0, hold, key))
            width = place.width
            self._noises.append(normals(seed, members, (STREAM + number,), width))

    def reset(self) -> State:
        """Return the state at the start.

        Its fields: "fault_phase" (N, faults), 0 before each, 1 while it lasts and 2 after it; and
        "fault_<number>_past" (N, motors, k), what the motors of a delayed or stuck one should have
        applied, the newest last.
        """
        state = {"fault_phase": np.full((self._vehicles, len(self._tables)), _WAITING)}
        for number, length in enumerate(self._lengths):
            if length:
                width = self._places[number].width
                state[f"fault_{number}_past"] = np.zeros((self._vehicles, width, length))
        return state

    def decide(
        self, state: State, now: float, measured: Mapping[str, Any] | None
    ) -> tuple[State, list[Event]]:
        """Return the state with what begins and ends at ``now`` [s], and the events of that.

        ``measured`` has the named tuples that a fault's ``when`` may depend on, by topic; None
        between control instants, where none begins by a signal.

        Raises:
            InputError: a fault depends on an unknown signal, with the near names.
        """
        phase = state["fault_phase"].copy()
        happened = []
        for number, fault in enumerate(self._tables):
            over = fault.until is not None and now >= fault.until - TICK
            ends = over & (phase[:, number] == _IN_FORCE)
            begins = ~np.bool_(over) & (phase[:, number] == _WAITING)
            begins &= self._is_due(number, now, measured)
            phase[ends, number], phase[begins, number] = _OVER, _IN_FORCE
            what = f"fault: {fault.motor} is {fault.kind}"
            happened += [Event(now, int(v), "WARNING", what) for v in np.flatnonzero(begins)]
            happened += [
                Event(now, int(v), "INFO", f"{what} no more") for v in np.flatnonzero(ends)
            ]
        return state | {"fault_phase": phase}, happened

    @property
    def noisy(self) -> bool:
        """Whether a motor has noise."""
        return any(KINDS[fault.kind].random for fault in self._tables)

    def due(self, after: float) -> float:
        """Return the first time from ``after`` on at which one begins or ends [s]."""
        times = (time for fault in self._tables for time in (fault.at, fault.until))
        return min((t for t in times if t is not None and t >= after - TICK), default=np.inf)

    @property
    def waiting(self) -> bool:
        """Whether one begins by a signal."""
        return any(fault.when is not None for fault in self._tables)

    def alarm(self, state: State, measured: Mapping[str, Any]) -> Array:
        """Return where one begins by a signal, True or False, (N, faults that do).

        Array code; ``measured`` is that of ``decide``.
        """
        phase, begins = state["fault_phase"], []
        for number, fault in enumerate(self._tables):
            if fault.when is not None:
                waits = phase[:, number] == _WAITING
                begins.append((waits & self._is_due(number, 0.0, measured))[:, None])
        return np.concatenate(begins, axis=-1)

    def change(
        self, state: State, applied: tuple[Array, ...], now: float
    ) -> tuple[State, tuple[Array, ...]]:
        """Return (state, what the motors apply instead of ``applied``) from ``now`` [s] on."""
        state, result = state.copy(), list(applied)
        for number, place in enumerate(self._places):
            kind, right = KINDS[self._tables[number].kind], result[place.kind][:, place.columns]
            field = f"fault_{number}_past"
            past = state.get(field)
            wrong = self._faulty(number, right, past, now)
            in_force = state["fault_phase"][:, number] == _IN_FORCE
            if past is not None:
                newest = np.concatenate([past[..., 1:], right[..., None]], axis=-1)
                keeps = in_force & kind.remembers_begin
                state[field] = np.where(keeps[:, None, None], past, newest)
            changed = result[place.kind].copy()
            changed[:, place.columns] = np.where(in_force[:, None], wrong, right)
            result[place.kind] = changed
        for number, actuator in enumerate(self._kinds):
            state, result[number] = actuator.account(
                state, applied[number], result[number], self._hold
            )
        return state, tuple(result)

    def _faulty(self, number: int, right: Array, past: Array | None, now: float) -> Array:
        """Return what the fault's motors apply where it is in force, (N, motors)."""
        fault = self._tables[number]
        oldest = np.zeros(0) if past is None else past[..., 0]
        noise = lambda: self._noises[number](round(now / self._hold))  # noqa: E731
        return KINDS[fault.kind].faulty(right, fault.value or 0.0, oldest, noise)

    def _is_due(self, number: int, now: float, measured: Mapping[str, Any] | None) -> Any:
        fault = self._tables[number]
        if fault.at is not None:
            return now >= fault.at - TICK
        if fault.when is None or measured is None:
            return np.bool_(False)
        arrays = {
            f"/{topic}": {n: _as_array(a) for n, a in values._asdict().items() if np.size(a)}
            for topic, values in measured.items()
            if values
        }
        topics = {t: {n: a.shape[1:] for n, a in fields.items()} for t, fields in arrays.items()}
        with input_error_at(f"faults.{number}.when.signal"):
            topic, field, part = find_signal(topics, fault.when.signal)
        values = arrays[topic][field]
        rows = values.reshape(len(values), -1)
        return fault.when.admits(magnitude(rows[:, part]))


def _places(kinds: Sequence[Actuator]) -> dict[str, _Place]:
    """Return the motors by each name that they have: their own, or as /command has them."""
    known = {}
    for number, kind in enumerate(kinds):
        columns = range(kind.drives.width)
        for column, name in zip(columns, kind.drives.motors, strict=False):
            known[name] = _Place(number, slice(column, column + 1))
        for column in columns:
            known[f"{kind.logged_as}[{column}]"] = _Place(number, slice(column, column + 1))
        known[kind.logged_as] = _Place(number, slice(0, len(columns)))
    return known


def _as_array(values: Any) -> Any:
    """Return the values as an array; one that is traced is none of NumPy's, and stays."""
    return values if hasattr(values, "reshape") else np.asarray(values)
