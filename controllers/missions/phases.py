"""A mission in phases: a law made of laws, each flown until its condition for the next is met.

All arrays may have leading vehicle axes: every vehicle is in a phase of its own.
"""

from collections import namedtuple
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from mjspace.contract import TICK, Array, DesiredMotion, Gains, Law, Measurement, gain


@dataclass(frozen=True)
class Until(Gains):
    """When a phase is over: when all that is given here holds."""

    after: float = gain("s", default=0.0, at_least=0.0)
    """Least time since it began [s]."""
    signal: str = ""
    """A field of the measurement or one of its components: ``rate``, ``rate[2]``; of a vector its
    norm."""
    below: float = gain(default=np.inf, at_most=np.inf)
    """The signal must be less, in SI."""
    above: float = gain(default=-np.inf, at_least=-np.inf)
    """The signal must be greater, in SI."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.signal, str):
            raise ValueError(f"until.signal: got {self.signal!r}, should be text")
        bounded = np.isfinite(self.below) or np.isfinite(self.above)
        if bounded != bool(self.signal):
            raise ValueError("until: a signal and below or above go together")
        if self.signal:
            self._parsed()

    def holds(self, elapsed: Array, measurement: Measurement) -> Any:
        """Return whether it is met ``elapsed`` [s] (...) after the phase began, (...)."""
        late = elapsed >= self.after - TICK
        if not self.signal:
            return late
        name, part = self._parsed()
        seen = getattr(measurement, name)
        value = np.sqrt(np.sum(seen * seen, axis=-1)) if part is None else seen[..., part]
        return late & (value < self.below) & (value > self.above)

    def _parsed(self) -> tuple[str, int | None]:
        name, bracket, part = self.signal.removesuffix("]").partition("[")
        if not name.isidentifier() or bool(bracket) != part.isdigit():
            raise ValueError(
                f"until.signal: got {self.signal!r}, should be what is measured or a component of "
                "it, as 'rate' or 'rate[2]'"
            )
        return name, int(part) if bracket else None


@dataclass(frozen=True)
class Phase:
    """One law of the mission, and when the next one takes over."""

    name: str
    """Goes before the names of its state and signals: lower case, digits and underscores."""
    law: Law
    until: Until | None = None
    """The last phase has none."""


@dataclass(frozen=True)
class Phases:
    """Laws one after the other; each begins anew with what is measured when its turn comes.

    The state has that of every law; the command has every field that any of them commands, zero in
    phases whose law does not; the signals have every law's, no number while it does not fly.
    """

    phases: Sequence[Any]
    """Tables with the keys of ``Phase``, whose ``law`` and ``until`` are tables again."""

    def __post_init__(self) -> None:
        tables = isinstance(self.phases, Sequence) and not isinstance(self.phases, str)
        if not tables or not all(isinstance(table, Mapping) for table in self.phases):
            raise ValueError(f"phases: got {self.phases!r}, should be a list of tables")
        given = tuple(_phase(number, table) for number, table in enumerate(self.phases))
        object.__setattr__(self, "phases", given)
        names = [phase.name for phase in given]
        if not names or len(set(names)) < len(names):
            raise ValueError(f"phases: wanted one or more, with names of their own; got {names}")
        for number, phase in enumerate(given):
            last = number == len(given) - 1
            if last != (phase.until is None):
                how = "is the last and goes on: it has no" if last else "never ends: give it an"
                raise ValueError(f"phases.{number}: {phase.name!r} {how} until")

    @property
    def batched(self) -> bool:
        """Whether all of the laws handle leading axes."""
        return all(getattr(phase.law, "batched", False) for phase in self.phases)

    def reset(self, measurement: Measurement, reference: DesiredMotion) -> Any:
        """Return the state of the first phase; each law is stepped once, to see its arrays."""
        lead = measurement.rate.shape[:-1]
        states: list[Any] = []
        commands: dict[str, Any] = {}
        signals: dict[str, Any] = {"phase": (1,)}
        for phase in self.phases:
            if phase.until is not None:
                phase.until.holds(np.zeros(lead), measurement)  # refuses what is not measured
            states.append(phase.law.reset(measurement, reference))
            _, command, shown = phase.law.step(states[-1], 0.0, measurement, reference)
            commands |= {n: a.shape[len(lead) :] for n, a in _arrays(command).items()}
            signals |= {
                f"{phase.name}_{n}": a.shape[len(lead) :] for n, a in _arrays(shown).items()
            }
        none = np.zeros((*lead, 1))
        values = {"phase": none, "began": none.copy()}
        for phase, state in zip(self.phases, states, strict=True):
            values |= {f"{phase.name}_{name}": array for name, array in _arrays(state).items()}
        # What a state is made of goes with its type, so that a logged one can be flown from.
        layout = _Layout(tuple(states), _tuple("Command", commands), _tuple("Signals", signals))
        return _tuple("State", values, layout)(*values.values())

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: DesiredMotion
    ) -> tuple[Any, Any, Any]:
        """Return (state, command, signals) of the law whose phase it is at ``time`` [s]."""
        phase, began = state.phase[..., 0], state.began[..., 0]
        due = np.zeros(phase.shape, dtype=bool)
        for number, spec in enumerate(self.phases[:-1]):
            due |= (phase == number) & spec.until.holds(time - began, measurement)
        phase, began = phase + due, np.where(due, time, began)
        after: dict[str, Any] = {"phase": phase[..., None], "began": began[..., None]}
        command = _filled(state.layout.command, phase.shape, 0.0)
        signals = _filled(state.layout.signals, phase.shape, np.nan) | {"phase": after["phase"]}
        for number, spec in enumerate(self.phases):
            memory = state.layout.part(state, number, spec.name)
            flies = np.asarray(phase == number)
            if flies.any():
                if (begins := flies & due).any():
                    memory = _where(begins, spec.law.reset(measurement, reference), memory)
                flown, asked, shown = spec.law.step(memory, time, measurement, reference)
                memory = _where(flies, flown, memory)
                for name, array in _arrays(asked).items():
                    command[name] = _pick(flies, array, command[name])
                for name, array in _arrays(shown).items():
                    field = f"{spec.name}_{name}"
                    signals[field] = _pick(flies, array, signals[field])
            after |= {f"{spec.name}_{name}": array for name, array in _arrays(memory).items()}
        return (
            type(state)(**after),
            state.layout.command(**command),
            state.layout.signals(**signals),
        )


@dataclass(frozen=True)
class _Layout:
    """What the laws' states look like, and the types of command and signals."""

    states: tuple[Any, ...]
    command: Any
    signals: Any

    def part(self, state: Any, number: int, name: str) -> Any:
        """Return the state of the law of that ``number`` and ``name``."""
        like = self.states[number]
        names = getattr(like, "_fields", ())
        return type(like)(*(getattr(state, f"{name}_{n}") for n in names)) if names else like


def _phase(number: int, table: Mapping[str, Any]) -> Phase:
    """Return the phase that a table describes; ValueError for one that is none."""
    try:
        until = table.get("until")
        phase = Phase(**{**table, "until": None if until is None else Until(**until)})
    except (TypeError, ValueError) as error:
        keys = ", ".join(f.name for kind in (Phase, Until) for f in fields(kind))
        raise ValueError(f"phases.{number}: {error} (a phase and its until have {keys})") from None
    if not (isinstance(phase.name, str) and phase.name.isidentifier() and phase.name.islower()):
        raise ValueError(f"phases.{number}.name: {phase.name!r}: write a word in lower case")
    if not hasattr(phase.law, "step") or hasattr(phase.law, "inner"):
        raise ValueError(f"phases.{number}.law: wanted a table with a law's kind, without inner")
    return phase


def _tuple(name: str, shapes: Mapping[str, Any], layout: Any = None) -> Any:
    """Return a named tuple type with those fields; ``layout`` says what they hold."""
    bare = namedtuple(name, list(shapes))  # type: ignore[misc]
    return type(name, (bare,), {"__slots__": (), "layout": layout or dict(shapes)})


def _filled(kind: Any, lead: tuple[int, ...], value: float) -> dict[str, Any]:
    return {name: np.full((*lead, *shape), value) for name, shape in kind.layout.items()}


def _arrays(values: Any) -> dict[str, Any]:
    """Return the arrays of a named tuple, of which there may be none."""
    return {n: np.asarray(a) for n, a in values._asdict().items()} if values else {}


def _where(chosen: Any, one: Any, other: Any) -> Any:
    """Return the named tuple that is ``one`` where ``chosen`` (...), else the ``other``."""
    if not one:
        return one
    return type(one)(*(_pick(chosen, a, b) for a, b in zip(one, other, strict=True)))


def _pick(chosen: Any, one: Any, other: Any) -> Any:
    more = np.ndim(one) - chosen.ndim
    return np.where(chosen.reshape(chosen.shape + (1,) * more), one, other)
