"""The conformance suite: what every law in controllers/, found by discovery, must satisfy.

Each property is a function of (law, control period, instants) that raises AssertionError. A law
that breaks it is at the end of this file, so that each property is known to be able to fail.
"""

import functools
import importlib
import inspect
import sys
from collections.abc import Callable
from dataclasses import replace
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
import pytest

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Reference, TorqueCommand
from mjspace.scenario.files import scenario_names
from mjspace.scenario.loading import load
from mjspace.scenario.trust import controllers
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")

COUNT = 4
STEP = ["self", "state", "time", "measurement", "reference"]
UNFLOWN = {
    "lander_estimator:EstimatedStructure": "lander-estimated",
    "sun_acquisition:SunAcquisition": "sun-safe-mode",
}
"""Laws that no scenario names, and one that can fly each."""


def laws() -> list[str]:
    """Return ``module:Class`` of every class in controllers/ that is a law."""
    found = []
    for short, full in controllers().items():
        module = importlib.import_module(full)
        for name, kind in vars(module).items():
            if not inspect.isclass(kind) or kind.__module__ != module.__name__ or name[0] == "_":
                continue
            if inspect.isabstract(kind):
                continue
            if hasattr(kind, "step") and list(inspect.signature(kind.step).parameters) == STEP:
                found.append(f"{short}:{name}")
    return found


@functools.cache
def flown() -> dict[str, str]:
    """Return a scenario for each kind of law that one names, where it sees the sensors."""
    scenarios = {name: load(name)[0] for name in reversed(scenario_names())}
    return {one.law.kind: name for name, one in scenarios.items() if one.estimator is None}


class Watched:
    """A law that records what ``step`` receives."""

    def __init__(self, law: Any) -> None:
        self.law = law
        self.inputs: list[tuple[Measurement, Reference]] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self.law, name)

    def step(self, state: Any, time: float, measurement: Any, reference: Any) -> Any:
        self.inputs.append((measurement, reference))
        return self.law.step(state, time, measurement, reference)


@functools.cache
def inputs(kind: str) -> tuple[Any, float, list[tuple[Measurement, Reference]]]:
    """Return the law, its period and two instants of vehicles that differ, all read-only."""
    name = UNFLOWN.get(kind) or flown()[kind]
    overrides = [f"law.kind={kind}"] if kind in UNFLOWN else []
    scenario, folder = load(name, [*overrides, "checks=[]", "faults=[]", "events=[]"])
    period = scenario.rates.control
    assembly = assemble(scenario.model_copy(update={"duration": 2 * period}), folder)
    watched, members = Watched(assembly.law), list(range(COUNT))
    list(fly(replace(assembly, law=watched), first_start(assembly, members), members))
    draw = np.random.default_rng(3)
    spin = 1e-3 * draw.normal(size=(COUNT, 3))
    turn = att.from_rotation_vector(0.02 * draw.normal(size=(COUNT, 3)))
    found = []
    for row, (measured, desired) in enumerate(watched.inputs[:2]):
        changed = measured._replace(
            attitude=att.multiply(measured.attitude, turn),
            rate=measured.rate + (1.0 + 0.1 * row) * spin,
        )
        found.append((frozen(changed), frozen(desired)))
    return assembly.law, period, found


def frozen(arrays: Any) -> Any:
    """Return copies that nobody may write to."""
    copies = {name: np.array(array) for name, array in arrays._asdict().items()}
    for array in copies.values():
        array.flags.writeable = False
    return type(arrays)(**copies)


def leaves(parts: Any) -> list[np.ndarray]:
    """Return the arrays in named tuples of named tuples."""
    if isinstance(parts, Measurement):
        return [np.asarray(array) for array in parts._asdict().values()]
    if isinstance(parts, tuple):
        return [leaf for part in parts for leaf in leaves(part)]
    return [] if parts is None else [np.asarray(parts)]


def same(one: Any, other: Any) -> bool:
    """Return whether all arrays are the same, bit for bit but for the payload of a NaN."""
    pairs = zip(leaves(one), leaves(other), strict=True)
    return all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)


def outcome(law: Any, period: float, instants: Any) -> tuple[Any, ...]:
    """Return what the law returns at reset, at each instant, and from its inner loop."""
    state = law.reset(*instants[0])
    found = [state]
    for number, (measured, desired) in enumerate(instants):
        state, command, signals = law.step(state, number * period, measured, desired)
        found += [state, command, signals]
        if hasattr(law, "inner"):
            state, inner = law.inner(state, number * period, command, measured)
            found += [state, inner]
    return tuple(found)


UNWINDS = {"quaternion_feedback:Fixed"}
"""Laws for which q and -q are different attitudes, to show what follows from that."""


def writable(instants: Any) -> Any:
    return [
        (seen._map(np.array), type(desired)(*map(np.array, desired))) for seen, desired in instants
    ]


def repeats(law: Any, period: float, instants: Any) -> None:
    """The same inputs give the same outputs: no memory but the state."""
    assert same(outcome(law, period, instants), outcome(law, period, instants))


def keeps_memory(law: Any, period: float, instants: Any) -> None:
    """A step and an inner step leave the state that they receive as it was."""
    state = law.reset(*instants[0])
    for number, (measured, desired) in enumerate(instants):
        before = [leaf.copy() for leaf in leaves(state)]
        after, command, _ = law.step(state, number * period, measured, desired)
        assert all(map(np.array_equal, before, leaves(state)))
        if hasattr(law, "inner"):
            before = [leaf.copy() for leaf in leaves(after)]
            inner_after, _ = law.inner(after, number * period, command, measured)
            assert all(map(np.array_equal, before, leaves(after)))
            after = inner_after
        state = after


def keeps_inputs(law: Any, period: float, instants: Any) -> None:
    """Measurement and reference are not written to, even where they could be."""
    handed = writable(instants)
    outcome(law, period, handed)
    assert all(same(*pair) for pair in zip(handed, instants, strict=True))


def shares_nothing(law: Any, period: float, instants: Any) -> None:
    """No output is a view of an input, where a sensor may write its next sample."""
    inputs = [array for instant in instants for array in leaves(instant)]
    outputs = leaves(outcome(law, period, instants))
    assert not any(np.shares_memory(one, other) for one in outputs for other in inputs)


def is_finite(law: Any, period: float, instants: Any) -> None:
    """The state and the commands are finite; a law may well signal infinity."""
    state = law.reset(*instants[0])
    for number, (measured, desired) in enumerate(instants):
        state, command, _ = law.step(state, number * period, measured, desired)
        assert all(np.isfinite(leaf).all() for leaf in leaves((state, command)))
        if hasattr(law, "inner"):
            state, command = law.inner(state, number * period, command, measured)
            assert all(np.isfinite(leaf).all() for leaf in leaves((state, command)))


def is_batched(law: Any, period: float, instants: Any) -> None:
    """Each vehicle of a batch gets, bit for bit, what it gets alone, with its axis or without."""
    batch = leaves(outcome(law, period, instants))
    for index in range(COUNT):
        for part in (slice(index, index + 1), index):
            lone = [(measured._map(itemgetter(part)), desired) for measured, desired in instants]
            for one, many in zip(leaves(outcome(law, period, lone)), batch, strict=True):
                expected = many[part] if many.size else one[:0]
                assert np.array_equal(one, expected, equal_nan=True)


def flipped(instants: Any) -> Any:
    """Return the instants with the sign of some of the vehicles' measured quaternions changed."""
    signs = np.array([[-1.0], [1.0], [-1.0], [1.0]])
    return [
        (measured._replace(attitude=signs * measured.attitude), desired)
        for measured, desired in instants
    ]


def takes_either_sign(law: Any, period: float, instants: Any) -> None:
    """q and -q are one attitude: the commands are the same, bit for bit."""
    other = flipped(instants)
    one_state, other_state = law.reset(*instants[0]), law.reset(*other[0])
    for number in range(len(instants)):
        now = number * period
        one_state, one, _ = law.step(one_state, now, *instants[number])
        other_state, another, _ = law.step(other_state, now, *other[number])
        assert same(one, another)  # a change of sign is exact in floating point
        if hasattr(law, "inner"):
            one_state, one = law.inner(one_state, now, one, instants[number][0])
            other_state, another = law.inner(other_state, now, another, other[number][0])
            assert same(one, another)


def needs_no_engine(law: Any, period: float, instants: Any) -> None:
    """Nothing of a step imports MuJoCo or the log's library, not even late."""
    with pytest.MonkeyPatch.context() as patch:
        for module in ("mujoco", "mcap"):
            patch.setitem(sys.modules, module, None)
        try:
            outcome(law, period, instants)
        except ImportError as error:
            raise AssertionError(str(error)) from error


PROPERTIES = (
    repeats,
    keeps_memory,
    keeps_inputs,
    shares_nothing,
    is_finite,
    is_batched,
    takes_either_sign,
    needs_no_engine,
)


def test_the_laws_are_found() -> None:
    assert len(laws()) >= 43
    assert {"contraction:Ideal", "lander:VariableStructure", "phases:Phases"} <= set(laws())


@pytest.mark.parametrize("kind", laws())
@pytest.mark.parametrize("holds", PROPERTIES, ids=lambda holds: holds.__name__)
def test_every_law(kind: str, holds: Callable[..., None]) -> None:
    if kind in UNWINDS and holds is takes_either_sign:
        with pytest.raises(AssertionError):
            holds(*inputs(kind))
        return
    holds(*inputs(kind))


class Memory(NamedTuple):
    rate: Array


class Damper:
    """A law that has every property."""

    def reset(self, measurement: Measurement, reference: Reference) -> Memory:
        return Memory(measurement.rate.copy())

    def step(
        self, state: Memory, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Memory, TorqueCommand, None]:
        error = att.multiply(att.conjugate(reference.attitude), measurement.attitude)
        turn = np.sign(error[..., :1]) * error[..., 1:]
        torque = -turn - measurement.rate - 0.1 * state.rate
        return Memory(measurement.rate.copy()), TorqueCommand(torque), None


class Counts(Damper):
    calls = 0

    def step(self, state: Any, time: float, measurement: Any, reference: Any) -> Any:
        Counts.calls += 1
        state, command, _ = super().step(state, time, measurement, reference)
        return state, TorqueCommand(command.torque + 1e-9 * Counts.calls), None


class WritesItsMemory(Damper):
    def step(self, state: Any, time: float, measurement: Any, reference: Any) -> Any:
        result = super().step(state, time, measurement, reference)
        state.rate[...] += 1.0
        return result


class WritesTheMeasurement(Damper):
    def step(self, state: Any, time: float, measurement: Any, reference: Any) -> Any:
        if measurement.rate.flags.writeable:
            measurement.rate[...] = 0.0
        return super().step(state, time, measurement, reference)


class WritesTheReference(Damper):
    def step(self, state: Any, time: float, measurement: Any, reference: Any) -> Any:
        if reference.attitude.flags.writeable:
            reference.attitude[...] *= -1.0
        return super().step(state, time, measurement, reference)


class KeepsAView(Damper):
    def step(self, state: Any, time: float, measurement: Any, reference: Any) -> Any:
        _, command, signals = super().step(state, time, measurement, reference)
        return Memory(measurement.rate[:]), command, signals


class Divides(Damper):
    def step(self, state: Any, time: float, measurement: Any, reference: Any) -> Any:
        state, command, signals = super().step(state, time, measurement, reference)
        with np.errstate(all="ignore"):
            return state, TorqueCommand(command.torque / (0.0 * time)), signals


class DivergesInside(Damper):
    def inner(self, state: Any, time: float, command: Any, measurement: Any) -> Any:
        return Memory(np.full_like(state.rate, np.inf)), command


class Averages(Damper):
    def step(self, state: Any, time: float, measurement: Any, reference: Any) -> Any:
        state, command, signals = super().step(state, time, measurement, reference)
        return state, TorqueCommand(command.torque + command.torque.mean(axis=0)), signals


class NeedsTheAxis(Damper):
    def step(self, state: Any, time: float, measurement: Any, reference: Any) -> Any:
        state, command, signals = super().step(state, time, measurement, reference)
        total = np.linalg.norm(np.atleast_2d(command.torque), axis=1, keepdims=True)
        return state, TorqueCommand(command.torque / total), signals


class Unwinds(Damper):
    def step(self, state: Any, time: float, measurement: Any, reference: Any) -> Any:
        error = att.multiply(att.conjugate(reference.attitude), measurement.attitude)
        return state, TorqueCommand(-error[..., 1:] - measurement.rate), None


class UnwindsInside(Damper):
    def inner(self, state: Any, time: float, command: Any, measurement: Any) -> Any:
        return state, TorqueCommand(command.torque - measurement.attitude[..., 1:])


class Imports(Damper):
    def step(self, state: Any, time: float, measurement: Any, reference: Any) -> Any:
        import mujoco

        assert mujoco
        return super().step(state, time, measurement, reference)


BREAKS = [
    (repeats, Counts),
    (keeps_memory, WritesItsMemory),
    (keeps_inputs, WritesTheMeasurement),
    (keeps_inputs, WritesTheReference),
    (shares_nothing, KeepsAView),
    (is_finite, Divides),
    (is_finite, DivergesInside),
    (is_batched, Averages),
    (is_batched, NeedsTheAxis),
    (takes_either_sign, Unwinds),
    (takes_either_sign, UnwindsInside),
    (needs_no_engine, Imports),
]


@pytest.mark.parametrize(("property_", "broken"), BREAKS)
def test_a_law_that_breaks_a_property_is_found(
    property_: Callable[..., None], broken: type[Damper]
) -> None:
    _, period, instants = inputs("contraction:Ideal")
    property_(Damper(), period, instants)
    with pytest.raises(AssertionError):
        property_(broken(), period, instants)


def test_each_property_can_fail() -> None:
    assert {holds for holds, _ in BREAKS} == set(PROPERTIES)
