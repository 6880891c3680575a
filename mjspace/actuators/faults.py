"""Faults: what actuators apply, or sensors report, is changed on its way from a moment on."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from mjspace.actuators.base import Actuator, State
from mjspace.actuators.fault_kinds import KINDS, FaultKind
from mjspace.contract import TICK, Array, Event
from mjspace.errors import input_error_at, nearest
from mjspace.scenario.fields import AnyUnit, Finite, OneOrEach, Seconds, Table, Time
from mjspace.scenario.region import Region
from mjspace.sensors.fault_kinds import IN_FORCE, PHASE, STREAM
from mjspace.sensors.fault_kinds import KINDS as OF_SENSORS
from mjspace.sensors.noise import normals
from mjspace.signals import find_signal, magnitude

_WAITING, _IN_FORCE, _OVER = 0.0, IN_FORCE, 2.0
_KINDS = tuple({**KINDS, **OF_SENSORS})


def _listed(kinds: Mapping[str, Any]) -> str:
    return "; ".join(f"{name}, {kind.applies}" for name, kind in kinds.items())


class Fault(Table):
    """From a moment on a motor does not apply, or a sensor report, what it should; events say so.

    One of ``motor`` and ``sensor`` is given.
    """

    motor: str | None = None
    """Its name, ``wheel_0`` or ``thruster_3``; or all of a kind, or one of them, as /command has
    them: ``thruster_thrust``, ``thruster_thrust[3]``, ``magnetic_moment[2]``."""
    sensor: str | None = None
    """Its name: that of its table in ``sensors``."""
    kind: Literal[*_KINDS] = Field(  # type: ignore[valid-type]
        description=f"A motor applies: {_listed(KINDS)}. A sensor reports: {_listed(OF_SENSORS)}."
    )
    value: Annotated[float | list[Any], OneOrEach(Annotated[Finite, AnyUnit])] | None = Field(
        default=None,
        description="Of all kinds but dead and stuck: a number in SI or a quantity. Of a sensor "
        "that is biased or drifting also one for each axis.",
    )
    at: Time | None = None
    """When it begins: at the first integration step, or of a sensor control instant, that is not
    before."""
    when: Region | None = None
    """Or the first control period in which a signal is inside: one of ``truth`` as ideal sensors
    measure it, ``measurement``, ``command`` or ``law``."""
    until: Seconds | None = None
    """When it is over; never when left out."""

    @model_validator(mode="after")
    def _consistent(self) -> "Fault":
        if (self.motor is None) == (self.sensor is None):
            raise ValueError("motor and sensor: give one of them")
        what, kinds = ("motor", KINDS) if self.sensor is None else ("sensor", OF_SENSORS)
        if self.kind not in kinds:
            raise ValueError(f"kind: a {what} is {', '.join(kinds)}, and not {self.kind}")
        kind: Any = kinds[self.kind]
        if (self.value is not None) != kind.has_value:
            has = "one: give it" if kind.has_value else "none"
            raise ValueError(f"value: a {what} that is {self.kind} has {has}")
        if isinstance(self.value, list) and (self.motor is not None or not kind.of_axes):
            raise ValueError("value: got a list, should be a number")
        if (self.at is None) == (self.when is None):
            raise ValueError("at and when: give one of them")
        if self.at is not None and self.until is not None and self.until <= self.at:
            raise ValueError(f"until {self.until:g} s is not after at {self.at:g} s")
        if kind.is_positive and not self.size > 0.0:
            raise ValueError(f"value {self.size:g} of one that is {self.kind}: more than 0")
        if self.sensor is not None and kind.is_probability and not 0.0 < self.size <= 1.0:
            raise ValueError(f"value {self.size:g} of one that is {self.kind}: from 0 to 1")
        return self

    @property
    def size(self) -> float:
        """The value where it is one number; 0 without."""
        return self.value if isinstance(self.value, float) else 0.0

    @property
    def part(self) -> str:
        """Whose fault it is, as events have it."""
        return f"sensor {self.sensor}" if self.motor is None else self.motor


@dataclass(frozen=True)
class _Place:
    """Where a fault's motors are in what the kinds of actuators apply."""

    kind: int
    columns: slice

    @property
    def width(self) -> int:
        """How many motors they are."""
        return self.columns.stop - self.columns.start  # type: ignore[no-any-return]


@dataclass(frozen=True)
class _Motor:
    """A fault of motors."""

    kind: FaultKind
    value: float  # for the kind, of a hold
    place: _Place
    length: int  # of what is remembered
    noise: Callable[[int], Array]


def between(tables: Sequence[Fault], control: float) -> bool:
    """Tell whether a motor's begins or ends between control instants, ``control`` [s] apart."""
    of_motors = [fault for fault in tables if fault.motor is not None]
    times = [time for fault in of_motors for time in (fault.at, fault.until) if time is not None]
    return any(abs(time - control * round(time / control)) > TICK for time in times)


class FaultSet:
    """The faults of a batch of vehicles; all memory is in ``State``.

    A motor's fault begins and ends with an integration step; a sensor's, and one that depends on a
    signal, with a control period. Of several on one motor, each changes what those listed before it
    apply. What is wrong with sensors is theirs to report: here it is decided when.
    """

    def __init__(
        self,
        tables: Sequence[Fault],
        kinds: Sequence[Actuator],
        hold: float,
        seed: int,
        members: Sequence[int],
        control: float | None = None,
        sensors: Sequence[str] = (),
    ) -> None:
        """Find the parts; ``hold`` [s] is how long what actuators apply is held.

        ``control`` [s] is the control period, the ``hold`` when left out; ``sensors`` are those
        that there are.

        Raises:
            ValueError: no such motor or sensor, or a delay that is no whole number of holds.
        """
        self._tables, self._kinds, self._hold = tables, kinds, hold
        self._vehicles, self._control = len(members), control or hold
        known = _places(kinds)
        self._motors: dict[int, _Motor] = {}
        for number, fault in enumerate(tables):
            if fault.sensor is not None and fault.sensor not in sensors:
                near = nearest(fault.sensor, sensors)
                raise ValueError(f"faults.{number}.sensor: none is called {fault.sensor!r}{near}")
            if fault.motor is None:
                continue
            if fault.motor not in known:
                raise ValueError(
                    f"faults.{number}.motor: none is called {fault.motor!r}"
                    f"{nearest(fault.motor, known)}"
                )
            place, key, kind = known[fault.motor], f"faults.{number}.value", KINDS[fault.kind]
            length = kind.memory(fault.size, hold, key)
            noise = normals(seed, members, (STREAM + number,), place.width)
            value = kind.per_hold(fault.size, hold)
            self._motors[number] = _Motor(kind, value, place, length, noise)

    def reset(self) -> State:
        """Return the state at the start.

        Its fields: "fault_phase" (N, faults), 0 before each, 1 while it lasts and 2 after it; and
        "fault_<number>_past" (N, motors, k), what the motors of a delayed or stuck one should have
        applied, the newest last.
        """
        state = {PHASE: np.full((self._vehicles, len(self._tables)), _WAITING)}
        for number, motor in self._motors.items():
            if motor.length:
                shape = self._vehicles, motor.place.width, motor.length
                state[f"fault_{number}_past"] = np.zeros(shape)
        return state

    def decide_for_sensors(self, state: State, now: float) -> tuple[State, list[Event]]:
        """Return what ``decide`` does of sensors' faults that begin or end by the time.

        Before the sensors sample at the control instant ``now`` [s].
        """
        return self._decide(state, now, None, [n for n, f in enumerate(self._tables) if f.sensor])

    def decide(
        self, state: State, now: float, measured: Mapping[str, Any] | None
    ) -> tuple[State, list[Event]]:
        """Return the state with what begins and ends at ``now`` [s], and the events of that.

        ``measured`` has the named tuples that a fault's ``when`` may depend on, by topic; None
        between control instants, where none begins by a signal.

        Raises:
            InputError: a fault depends on an unknown signal, with the near names.
        """
        return self._decide(state, now, measured, range(len(self._tables)))

    def _decide(
        self, state: State, now: float, measured: Mapping[str, Any] | None, of: Sequence[int]
    ) -> tuple[State, list[Event]]:
        phase = state[PHASE].copy()
        happened = []
        for number in of:
            fault = self._tables[number]
            over = fault.until is not None and now >= fault.until - TICK
            ends = over & (phase[:, number] == _IN_FORCE)
            begins = ~np.bool_(over) & (phase[:, number] == _WAITING)
            begins &= self._is_due(number, now, measured)
            phase[ends, number], phase[begins, number] = _OVER, _IN_FORCE
            what = f"fault: {fault.part} is {fault.kind}"
            happened += [Event(now, int(v), "WARNING", what) for v in np.flatnonzero(begins)]
            happened += [
                Event(now, int(v), "INFO", f"{what} no more") for v in np.flatnonzero(ends)
            ]
        return state | {PHASE: phase}, happened

    @property
    def noisy(self) -> bool:
        """Whether a motor has noise."""
        return any(motor.kind.random for motor in self._motors.values())

    @property
    def of_sensors(self) -> bool:
        """Whether one is of a sensor."""
        return len(self._motors) < len(self._tables)

    def due(self, after: float) -> float:
        """Return the first time from ``after`` on at which one begins or ends [s]."""
        times = [
            time if fault.sensor is None else self._control * ceil((time - TICK) / self._control)
            for fault in self._tables
            for time in (fault.at, fault.until)
            if time is not None
        ]
        return min((time for time in times if time >= after - TICK), default=np.inf)

    @property
    def waiting(self) -> bool:
        """Whether one begins by a signal."""
        return any(fault.when is not None for fault in self._tables)

    def alarm(self, state: State, measured: Mapping[str, Any]) -> Array:
        """Return where one begins by a signal, True or False, (N, faults that do).

        Array code; ``measured`` is that of ``decide``.
        """
        phase, begins = state[PHASE], []
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
        for number, motor in self._motors.items():
            kind, place = motor.kind, motor.place
            right = result[place.kind][:, place.columns]
            field = f"fault_{number}_past"
            past = state.get(field)
            wrong = self._faulty(motor, right, past, now)
            in_force = state[PHASE][:, number] == _IN_FORCE
            if past is not None:
                last = np.where(in_force[:, None], wrong, right) if kind.remembers_faulty else right
                newest = np.concatenate([past[..., 1:], last[..., None]], axis=-1)
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

    def _faulty(self, motor: "_Motor", right: Array, past: Array | None, now: float) -> Array:
        """Return what the fault's motors apply where it is in force, (N, motors)."""
        oldest = np.zeros(0) if past is None else past[..., 0]
        noise = lambda: motor.noise(round(now / self._hold))  # noqa: E731
        return motor.kind.faulty(right, motor.value, oldest, noise)

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
