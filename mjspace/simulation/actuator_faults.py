"""Faults as a step effect: when they begin and end, and what motors apply under them."""

from collections.abc import Sequence
from typing import ClassVar, Self

from mjspace.actuators.faults import FaultSet
from mjspace.contract import Array, Event
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.joined import topics_of
from mjspace.vehicle.step_effect import Instant, State, StepEffect, Topics


class ActuatorFaults(StepEffect):
    """The scenario's faults: they begin, change what actuators apply, and end."""

    name: ClassVar[str] = "the faults"

    @classmethod
    def of(cls, assembly: Assembly, members: Sequence[int]) -> Self | None:
        """Return the faults of these members of the campaign; None where the scenario has none."""
        faults = assembly.faults(members)
        return None if faults is None else cls(faults, between=assembly.faults_between)

    def __init__(self, faults: FaultSet, *, between: bool) -> None:
        """Keep the ``faults``; ``between``: one begins or ends between control instants."""
        self._faults, self._between = faults, between
        # Its random numbers are drawn in each step.
        self.waits = faults.waiting
        self.not_compiled = "a noisy motor is called in Python" if faults.noisy else ""

    def reset(self, physics: Array) -> State:
        """Return the faults' state at the start, ``FaultSet.reset``."""
        return self._faults.reset()

    def observe(self, memory: State, physics: Array, time: float, events: list[Event]) -> State:
        """Begin and end sensors' faults by the time, before the sensors sample."""
        if self._faults.of_sensors:
            memory, happened = self._faults.decide_for_sensors(memory, time)
            events.extend(happened)
        return memory

    def at_control(self, memory: State, instant: Instant) -> State:
        """Begin and end what is due, by the time or by a signal of this instant."""
        topics = {
            "truth": instant.truth,
            "measurement": instant.measurement,
            "command": instant.command,
            **topics_of(instant.signals),
        }
        memory, events = self._faults.decide(memory, instant.time, topics)
        instant.events.extend(events)
        return memory

    def change(
        self, memory: State, applied: tuple[Array, ...], instant: Instant
    ) -> tuple[State, tuple[Array, ...]]:
        """Return (memory, what the motors apply with the faults that are in force)."""
        if self._between and not instant.is_control:
            memory, events = self._faults.decide(memory, instant.time, None)
            instant.events.extend(events)
        return self._faults.change(memory, applied, instant.time)

    def alarm(self, memory: State, topics: Topics) -> Array:
        """Return where a fault begins by a signal."""
        return self._faults.alarm(memory, topics)

    def due(self, after: float) -> float:
        """Return when the next fault begins or ends by the time."""
        return self._faults.due(after)
