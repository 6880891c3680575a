"""A mission in phases: a sequence of laws, each flown until its end condition is met.

All arrays may have leading vehicle axes: every vehicle changes phase independently.
"""

from collections import namedtuple
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from mjspace.contract import TICK, Array, DesiredMotion, Gains, Law, Measurement, gain


@dataclass(frozen=True)
class Until(Gains):
    """End condition of a phase: all conditions set here hold."""

    after: float = gain("s", default=0.0, at_least=0.0)
    """Least time since the phase began [s]."""
    signal: str = ""
    """A field of the measurement, whose norm counts, or one of its components: ``rate``,
    ``rate[2]``."""
    below: float = gain(None, default=np.inf, at_most=np.inf)
    """The signal must be less; a number in SI or a quantity."""
    above: float = gain(None, default=-np.inf, at_least=-np.inf)
    """The signal must be greater; a number in SI or a quantity."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.signal, str):
            raise ValueError(f"signal: got {self.signal!r}, should be text")
        bounded = np.isfinite(self.below) or np.isfinite(self.above)
        if bounded != bool(self.signal):
            raise ValueError("a signal and below or above go together")
        if self.signal:
            self._parsed()

    def holds(self, elapsed: Array, measurement: Measurement) -> Any:
        """Tell where the condition holds, (...), ``elapsed`` [s] (...) after the phase began."""
        late = elapsed >= self.after - TICK
        if not self.signal:
            return late
        name, part = self._parsed()
        field = getattr(measurement, name)
        value = np.sqrt(np.sum(field * field, axis=-1)) if part is None else field[..., part]
        return late & (value < self.below) & (value > self.above)

    def _parsed(self) -> tuple[str, int | None]:
        name, bracket, part = self.signal.removesuffix("]").partition("[")
        if not name.isidentifier() or bool(bracket) != part.isdigit():
            raise ValueError(
                f"signal: got {self.signal!r}, should be what is measured or a component of "
                "it, as 'rate' or 'rate[2]'"
            )
        return name, int(part) if bracket else None


@dataclass(frozen=True)
class Phase:
    """One law of the mission, with its end condition."""

    name: str
    """Prefix of the names of its state and signals: lower case, digits and underscores."""
    law: Law
    """In a scenario a table with the law's ``kind`` and gains."""
    until: Until | None = None
    """The last phase has none."""

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and self.name.isidentifier() and self.name.islower()):
            raise ValueError(f"name: got {self.name!r}, should be a word in lower case")
        if not hasattr(self.law, "step") or hasattr(self.law, "inner"):
            raise ValueError("law: should be a table with the kind of a law that has no inner")
        if not isinstance(self.until, Until | None):
            keys = ", ".join(each.name for each in fields(Until))
            raise ValueError(f"until: got {self.until!r}, should be a table with {keys}")


@dataclass(frozen=True)
class Phases:
    """A sequence of laws; each is reset with the measurement at the start of its phase.

    The state contains that of every law. The command has every field that any law commands, zero in
    the phases of other laws. The signals have those of every law, NaN while it does not fly.
    """

    phases: Sequence[Phase]

    def __post_init__(self) -> None:
        tables = isinstance(self.phases, Sequence) and not isinstance(self.phases, str)
        if not tables or not all(isinstance(phase, Phase) for phase in self.phases):
            raise ValueError(f"phases: got {self.phases!r}, should be a list of tables")
        object.__setattr__(self, "phases", tuple(self.phases))
        names = [phase.name for phase in self.phases]
        if not names or len(set(names)) < len(names):
            raise ValueError(f"phases: got {names}, should be one or more, with different names")
        for number, phase in enumerate(self.phases):
            last = number == len(names) - 1
            if last != (phase.until is None):
                how = "is the last and takes no" if last else "would never end: it needs an"
                raise ValueError(f"phases.{number}: {phase.name!r} {how} until")

    @property
    def batched(self) -> bool:
        """Whether all of the laws handle leading axes."""
        return all(getattr(phase.law, "batched", False) for phase in self.phases)

    def reset(self, measurement: Measurement, reference: DesiredMotion) -> Any:
        """Return the initial state; each law is stepped once to find the shapes of its arrays."""
        lead = measurement.rate.shape[:-1]
        states: list[Any] = []
        commands: dict[str, Any] = {}
        signals: dict[str, Any] = {"phase": (1,)}
        hints: dict[str, Any] = {}
        signal_hints: dict[str, Any] = {}
        for phase in self.phases:
            if phase.until is not None:
                phase.until.holds(np.zeros(lead), measurement)  # refuses what is not measured
            states.append(phase.law.reset(measurement, reference))
            _, command, own = phase.law.step(states[-1], 0.0, measurement, reference)
            commands |= {n: a.shape[len(lead) :] for n, a in _arrays(command).items()}
            signals |= {f"{phase.name}_{n}": a.shape[len(lead) :] for n, a in _arrays(own).items()}
            hints |= _annotations(command)
            signal_hints |= {f"{phase.name}_{n}": a for n, a in _annotations(own).items()}
        none = np.zeros((*lead, 1))
        values = {"phase": none, "began": none.copy()}
        for phase, state in zip(self.phases, states, strict=True):
            values |= {f"{phase.name}_{name}": array for name, array in _arrays(state).items()}
        # The layout is stored in the state's type, so that a flight can start from a logged state.
        layout = _Layout(
            tuple(states),
            _tuple("Command", commands, hints=hints),
            _tuple("Signals", signals, hints=signal_hints),
        )
        return _tuple("State", values, layout)(*values.values())

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: DesiredMotion
    ) -> tuple[Any, Any, Any]:
        """Return (state, command, signals), those of the law that is active at ``time`` [s]."""
        phase, began = state.phase[..., 0], state.began[..., 0]
        due = np.zeros(phase.shape, dtype=bool)
        for number, spec in enumerate(self.phases):
            if spec.until is not None:
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
                flown, own_command, own_signals = spec.law.step(
                    memory, time, measurement, reference
                )
                memory = _where(flies, flown, memory)
                for name, array in _arrays(own_command).items():
                    command[name] = _pick(flies, array, command[name])
                for name, array in _arrays(own_signals).items():
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
    """The laws' states as templates, and the types of command and signals."""

    states: tuple[Any, ...]
    command: Any
    signals: Any

    def part(self, state: Any, number: int, name: str) -> Any:
        """Return the state of the law of that ``number`` and ``name``."""
        like = self.states[number]
        names = getattr(like, "_fields", ())
        return type(like)(*(getattr(state, f"{name}_{n}") for n in names)) if names else like


def _tuple(
    name: str, shapes: Mapping[str, Any], layout: Any = None, hints: Mapping[str, Any] = {}
) -> Any:
    """Return a named tuple type with those fields and a class attribute ``layout``.

    ``hints`` are the annotations of the fields, which carry the units.
    """
    bare = namedtuple(name, list(shapes))  # type: ignore[misc]
    content = {"__slots__": (), "layout": layout or dict(shapes), "__annotations__": dict(hints)}
    return type(name, (bare,), content)


def _annotations(values: Any) -> dict[str, Any]:
    """Return the annotations of the fields of a named tuple; none for None."""
    return dict(getattr(type(values), "__annotations__", {}))


def _filled(kind: Any, lead: tuple[int, ...], value: float) -> dict[str, Any]:
    return {name: np.full((*lead, *shape), value) for name, shape in kind.layout.items()}


def _arrays(values: Any) -> dict[str, Any]:
    """Return the arrays of a named tuple by name; none where it is empty or None."""
    return {n: np.asarray(a) for n, a in values._asdict().items()} if values else {}


def _where(chosen: Any, one: Any, other: Any) -> Any:
    """Return the named tuple with the values of ``one`` where ``chosen`` (...), else ``other``."""
    if not one:
        return one
    return type(one)(*(_pick(chosen, a, b) for a, b in zip(one, other, strict=True)))


def _pick(chosen: Any, one: Any, other: Any) -> Any:
    more = np.ndim(one) - chosen.ndim
    return np.where(chosen.reshape(chosen.shape + (1,) * more), one, other)
