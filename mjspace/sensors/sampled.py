"""A sensor that is not ideal: its samples with their errors and faults, and when they arrive."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import gcd
from typing import Any

import numpy as np
from scipy.special import ndtri

from mjspace.contract import Array, Measurement
from mjspace.sensors.base import Sensor, State, Surroundings
from mjspace.sensors.fault_kinds import IN_FORCE, Sample, SensorFaultKind


@dataclass(frozen=True)
class Fault:
    """A fault of this sensor."""

    number: int
    """In the scenario."""
    kind: SensorFaultKind
    value: Any
    """A number, or of each axis (axes,)."""
    late: int = 0
    """Samples that it delays."""

    def in_force(self, phase: Array | None) -> Any:
        """Return where it is, (N, 1), by the ``phase`` of all faults; None: not yet."""
        if phase is None:
            return np.zeros((1, 1), bool)
        found: Array = phase[..., self.number : self.number + 1] == IN_FORCE
        return found


@dataclass(frozen=True)
class Sampled:
    """A sensor that is not ideal, with the random streams of each vehicle's."""

    name: str
    table: Sensor[Any]
    quantity: str
    """The field of the truth that it samples."""
    period: int
    """Of its samples, in integration steps."""
    span: float
    """The same [s]."""
    delay: int
    """Whole samples that a report is behind."""
    arrival: int
    """Integration steps from a sample to the next arrival of one; 0: together."""
    fixed: Mapping[str, Array]
    """What is constant in a flight, (N, ...)."""
    draws: Mapping[str, Callable[[int], Array]]
    """Standard normal numbers of a sample, (N, k), by purpose."""
    noise: float
    """Standard deviation of a sample's."""
    walk: float
    """Standard deviation of one period's increment."""
    markov: tuple[float, float]
    """As ``Sensor.markov``."""
    nothing: Array
    """What it reports without power, (width,)."""
    faults: Sequence[Fault] = ()
    marks: Mapping[str, Any] = field(default_factory=dict)
    """For ``take_where_due``: of "due" and "arrives" 1.0 or 0.0, (1, 1); always where left out."""

    @cached_property
    def flagged(self) -> bool:
        """Whether its samples have a validity, as a last column."""
        return bool(self.faults) or not self.table.always_valid

    @property
    def tick(self) -> int:
        """Integration steps of which all that happens to it is a multiple."""
        return gcd(self.period, self.arrival)

    @property
    def phases(self) -> dict[str, int]:
        """Integration steps after a sample is taken at which each of ``marks`` is 1.0."""
        return {"due": 0} | ({"arrives": self.arrival} if self.arrival else {})

    @property
    def drawn(self) -> dict[str, int]:
        """The purposes of the numbers that a sample draws, and how far ahead of its own."""
        lost = [f"lost_{each.number}" for each in self.faults if each.kind.is_probability]
        of = {"white": self.noise, "increment": self.table.bias_walk}
        ahead = {"markov": 1} if self.table.bias_instability else {}
        return {name: 0 for name, needed in of.items() if needed} | ahead | dict.fromkeys(lost, 0)

    @cached_property
    def samples_field(self) -> str:
        """Of its last samples, (N, k, width), the reported one first."""
        return f"{self.name}_samples"

    @cached_property
    def report_field(self) -> str:
        """Of what it reports, (N, k, width), first."""
        return f"{self.name}_report" if self._latest else self.samples_field

    @cached_property
    def _latest(self) -> int:
        return max((fault.late for fault in self.faults), default=0)

    def begin(self, state: State, truth: Measurement) -> None:
        """Put what it remembers before its first sample into ``state``."""
        table = self.table
        if table.integrates:
            value = table.begin(state, self.name, truth)
        else:
            value = getattr(truth, self.quantity)
        if table.bias_walk:
            state[f"{self.name}_walk"] = np.zeros_like(self.fixed["bias"])
        if table.bias_instability:
            state[f"{self.name}_markov"] = table.bias_instability * self.draws["markov"](0)
        if self._drifts:
            state[f"{self.name}_since"] = np.zeros((len(value), len(self._drifts)))
        first = self._sample(state, 0, value, truth, None)
        kept = self.delay + 1 + bool(self.arrival)
        state[self.samples_field] = np.repeat(first[:, None], kept, axis=1)
        if self._latest:
            state[f"{self.name}_arrived"] = np.repeat(first[:, None], self._latest + 1, axis=1)
            state[self.report_field] = first[:, None].copy()

    def take(
        self,
        state: State,
        step: int,
        truth: Measurement,
        phase: Array | None,
        surroundings: Surroundings,
    ) -> None:
        """Put what happens at an integration ``step`` into ``state``."""
        if step % self.period == 0:
            self._take(state, step // self.period, truth, phase, surroundings)
        elif step % self.period == self.arrival:
            self._arrive(state, phase)

    def take_where_due(
        self, state: State, truth: Measurement, phase: Array | None, surroundings: Surroundings
    ) -> None:
        """Put what happens at any control instant but 0 into ``state``, by ``marks``."""
        actions: list[tuple[str, Callable[[], None]]] = [
            ("due", lambda: self._take(state, 1, truth, phase, surroundings))
        ]
        if self.arrival:
            actions.append(("arrives", lambda: self._arrive(state, phase)))
        for mark, act in actions:
            before = state.copy()
            act()
            if mark in self.marks:
                now = self.marks[mark] > 0.5
                for name, held in before.items():
                    if state[name] is not held:
                        at = now if held.ndim == 2 else now[..., None]
                        state[name] = np.where(at, state[name], held)

    def _take(
        self,
        state: State,
        index: int,
        truth: Measurement,
        phase: Array | None,
        surroundings: Surroundings,
    ) -> None:
        """Put sample ``index``, and what follows it, into ``state``."""
        table, name = self.table, self.name
        if not table.integrates:
            value = getattr(truth, self.quantity)
        elif index == 0:
            value = table.begin(state, name, truth)
        else:
            value = table.mean(state, name, truth, self.span, surroundings)
        new = self._sample(state, index, value, truth, phase)[:, None]
        kept = state[self.samples_field]
        if self.arrival:
            new = np.concatenate([kept[:, :1], kept[:, 2:], new], axis=1)
        elif self.delay:
            new = np.concatenate([kept[:, 1:], new], axis=1)
        state[self.samples_field] = new
        if not self.arrival:
            self._report(state, phase)
        if table.bias_walk:
            walk = self.walk * self.draws["increment"](index)
            state[f"{name}_walk"] = state[f"{name}_walk"] + walk
        if table.bias_instability:
            part, spread = self.markov
            comes = spread * self.draws["markov"](index + 1)
            state[f"{name}_markov"] = part * state[f"{name}_markov"] + comes
        if self._drifts:
            since = state[f"{name}_since"]
            ages = [
                np.where(fault.in_force(phase), since[:, k : k + 1] + self.span, 0.0)
                for k, fault in enumerate(self._drifts)
            ]
            state[f"{name}_since"] = np.concatenate(ages, axis=-1)

    def _arrive(self, state: State, phase: Array | None) -> None:
        """Report the sample that is old enough now."""
        kept = state[self.samples_field]
        state[self.samples_field] = np.concatenate([kept[:, 1:2], kept[:, 1:]], axis=1)
        self._report(state, phase)

    def _report(self, state: State, phase: Array | None) -> None:
        """Let a slow link report what arrived before."""
        if not self._latest:
            return
        prompt, arrived = state[self.samples_field][:, :1], f"{self.name}_arrived"
        state[arrived] = np.concatenate([state[arrived][:, 1:], prompt], axis=1)
        report = prompt
        for fault in self.faults:
            if fault.late:
                then = self._latest - fault.late
                at = fault.in_force(phase)[..., None]
                report = np.where(at, state[arrived][:, then : then + 1], report)
        state[self.report_field] = report

    @cached_property
    def _drifts(self) -> list[Fault]:
        return [fault for fault in self.faults if fault.kind.per_second]

    def _sample(
        self, state: State, index: int, value: Array, truth: Measurement, phase: Array | None
    ) -> Array:
        """Return what sample ``index`` reports of the ``value``, with its validity if flagged."""
        table = self.table
        faults = [(fault, fault.in_force(phase)) for fault in self.faults]
        error = self.fixed["bias"]
        if self.noise:
            white = self.noise * table.weighted(self.draws["white"](index))
            for fault, in_force in faults:
                if (gain := fault.kind.gain(fault.value)) != 1.0:
                    white = white * np.where(in_force, gain, 1.0)
            error = error + white
        if table.bias_walk:
            error = error + state[f"{self.name}_walk"]
        if table.bias_instability:
            error = error + state[f"{self.name}_markov"]
        drifts = 0
        for fault, in_force in faults:
            if fault.kind.of_axes:
                since = np.zeros(1)
                if fault.kind.per_second:
                    since = state[f"{self.name}_since"][:, drifts : drifts + 1]
                    drifts += 1
                error = error + np.where(in_force, fault.kind.offset(fault.value, since), 0.0)
        result = table.with_error(table.deformed(value, self.fixed), error)
        if not self.flagged:
            return result
        if table.always_valid:
            valid = np.ones((len(result), 1))
        else:
            valid = getattr(truth, f"{self.name}_valid")
        sample, kept = Sample(result, valid), state.get(self.samples_field)
        if kept is not None:
            held = kept[:, -1, :-1]
            if table.holds:
                sample = sample._replace(values=np.where(valid > 0.5, result, held))
            for fault, in_force in faults:
                lost: Any = None
                if fault.kind.is_probability:
                    lost = self.draws[f"lost_{fault.number}"](index) < ndtri(fault.value)
                other = fault.kind.result(sample, held, self.nothing, lost)
                sample = Sample(*(map(np.where, (in_force, in_force), other, sample)))
        return np.concatenate(sample, axis=-1)
