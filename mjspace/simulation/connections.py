"""Connections of spacecraft as a step effect: when each closes, and when it opens."""

from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np

from mjspace.contract import TICK, Array, Event, Measurement
from mjspace.environment.connection import CLOSED, OPEN, RELEASED, Connection, Latch
from mjspace.environment.install import places_of
from mjspace.simulation import model_sensors
from mjspace.simulation.assembly import Assembly
from mjspace.vehicle.relative_motion import CENTER_VELOCITY
from mjspace.vehicle.step_effect import Instant, State, StepEffect, Write

_STATE = "connection_state"


@dataclass(eq=False)
class Connections(StepEffect):
    """Closes and opens the latches of a batch of vehicles at control instants.

    The truth has ``<connection>_closed`` for each, 1.0 or 0.0, (N, 1); the log the velocity of the
    centre of mass of all that flies as well.
    """

    name: ClassVar[str] = "the connection"
    not_compiled = ""
    looks: ClassVar[bool] = True

    tables: dict[str, Connection]
    places: list[int]
    """Of each connection's state in ``userdata``."""
    center: slice
    """Of the common centre's velocity in ``sensordata``."""
    _acting: Any = field(init=False, repr=False, default=None)

    @classmethod
    def of(cls, assembly: Assembly) -> Self | None:
        """Return the effect; None where the vehicle flies alone."""
        vehicle, scenario = assembly.vehicle, assembly.scenario
        if not vehicle.relative:
            return None
        sensor = vehicle.model.sensor(CENTER_VELOCITY)
        first = int(sensor.adr[0])
        places = places_of(Latch, scenario.environment, scenario.plant)
        return cls(scenario.plant.connections, places, slice(first, first + 3))

    def bind(self, batch: Any) -> None:
        """Take the connections' states in ``userdata``."""
        self._acting = batch.bind("userdata")

    def reset(self, physics: Array) -> State:
        """Return the state at the start: "connection_state", (N, k)."""
        first = [CLOSED if table.closed else OPEN for table in self.tables.values()]
        return {_STATE: np.tile(first, (len(physics), 1))}

    def observe(self, memory: State, physics: Array, time: float, events: list[Event]) -> State:
        """Return the memory at a control instant, and tell what closes or opens."""
        after, report = self.look(memory, physics, physics)
        if report.any():
            events += self._told(memory, after, time)
        return after

    def look(self, memory: State, physics: Array, sensordata: Array) -> tuple[State, Array]:
        """Return the memory with what is closed now, and where anything closes or opens."""
        before, now = memory[_STATE], physics[:, :1] + TICK
        if not self.tables:
            return memory, np.zeros((len(physics), 1), bool)
        columns = []
        for k, (name, table) in enumerate(self.tables.items()):
            state = before[:, k : k + 1]
            closes = (state == OPEN) & (now >= table.closes.after)
            closes = closes & self._fits(memory, name, table)
            state = np.where(closes, CLOSED, state)
            if table.opens_at is not None:
                state = np.where(now >= table.opens_at, RELEASED, state)
            columns.append(state)
        after = np.concatenate(columns, axis=-1)
        changed: Array = (after != before).any(axis=1, keepdims=True)
        return memory | {_STATE: after}, changed

    def _fits(self, memory: State, name: str, table: Connection) -> Any:
        """Return where the ports are near enough to close, (N, 1)."""
        limits, (distance, angle, speed) = table.closes, self._off(memory, name)
        near = (distance <= limits.distance) & (angle <= limits.angle)
        return near if limits.speed is None else near & (speed <= limits.speed)

    def _off(self, memory: State, name: str) -> tuple[Array, Array, Array]:
        """Return distance [m], angle [rad] and relative speed [m/s] of the two ports, (N, 1)."""
        read = {
            quantity: memory[f"{model_sensors.PREFIX}{name}_{quantity}"]
            for quantity in ("position", "attitude", "velocity")
        }
        turned = read["attitude"]
        angle = 2.0 * np.arctan2(_norm(turned[:, 1:]), np.abs(turned[:, :1]))
        return _norm(read["position"]), angle, _norm(read["velocity"])

    def _told(self, before: State, after: State, now: float) -> list[Event]:
        events = []
        for vehicle, k in np.argwhere(after[_STATE] != before[_STATE]):
            name = list(self.tables)[k]
            text = f"{name} opens"
            if after[_STATE][vehicle, k] == CLOSED:
                off = self._off(after, name)
                distance, angle, speed = (float(each[vehicle, 0]) for each in off)
                text = (
                    f"{name} closes: the ports are {1e3 * distance:.3g} mm and "
                    f"{np.degrees(angle):.3g} deg apart, at {1e3 * speed:.3g} mm/s"
                )
            events.append(Event(now, int(vehicle), "INFO", text))
        return events

    def add_to_truth(self, memory: State, truth: Measurement) -> Measurement:
        """Return the truth with what is closed."""
        state: Any = memory[_STATE]
        closed = {
            f"{name}_closed": (state[..., k : k + 1] == CLOSED).astype(float)
            for k, name in enumerate(self.tables)
        }
        return truth._replace(**closed)

    def before_step(self, memory: State, instant: Instant) -> State:
        """Let the latches act as they are."""
        for k, place in enumerate(self.places):
            self._acting[:, place] = memory[_STATE][:, k]
        return memory

    def prepare(
        self, memory: State, physics: Array, time: Array, known: Array
    ) -> tuple[list[Write], Array | None]:
        """Return that the states are written."""
        state = memory[_STATE]
        writes = [
            Write("userdata", place, state[:, k : k + 1]) for k, place in enumerate(self.places)
        ]
        return writes, None

    def due(self, after: float) -> float:
        """Return when the next connection opens."""
        times = [t.opens_at for t in self.tables.values() if t.opens_at is not None]
        return min((time for time in times if time >= after - TICK), default=np.inf)

    def logged(self, memory: State, sensordata: Array) -> dict[str, Array]:
        """Return the velocity of the common centre of mass [m/s], inertial axes."""
        return {CENTER_VELOCITY: sensordata[..., self.center]}


def _norm(vectors: Array) -> Array:
    norm: Array = np.sqrt(np.sum(vectors**2, axis=-1, keepdims=True))
    return norm
