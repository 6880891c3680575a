"""Every law of controllers/, found by itself: it is a pure function, of one vehicle or of many."""

import functools
import importlib
import inspect
from dataclasses import replace
from operator import itemgetter
from typing import Any

import numpy as np
import pytest

from mjspace import attitude as att
from mjspace.contract import Measurement, Reference
from mjspace.scenario.construct import controllers
from mjspace.scenario.loading import load, scenario_names
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")

COUNT = 4
STEP = ["self", "state", "time", "measurement", "reference"]
UNFLOWN = {"lander_estimator:EstimatedStructure": "lander-estimated"}
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
    """Return a scenario for each kind of law that one names."""
    return {load(name)[0].law.kind: name for name in reversed(scenario_names())}


class Watched:
    """A law whose inputs are kept."""

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
    for row, (seen, wanted) in enumerate(watched.inputs[:2]):
        changed = seen._replace(
            attitude=att.multiply(seen.attitude, turn), rate=seen.rate + (1.0 + 0.1 * row) * spin
        )
        found.append((frozen(changed), frozen(wanted)))
    return assembly.law, period, found


def frozen(arrays: Any) -> Any:
    """Return copies that nobody may write to."""
    copies = {name: np.array(array) for name, array in arrays._asdict().items()}
    for array in copies.values():
        array.flags.writeable = False
    return type(arrays)(**copies)


def leaves(parts: Any) -> list[np.ndarray]:
    """Return the arrays in named tuples of named tuples."""
    if isinstance(parts, tuple):
        return [leaf for part in parts for leaf in leaves(part)]
    return [] if parts is None else [np.asarray(parts)]


def same(one: Any, other: Any) -> bool:
    pairs = zip(leaves(one), leaves(other), strict=True)
    return all(np.array_equal(a, b, equal_nan=True) for a, b in pairs)


def outcome(law: Any, period: float, instants: Any) -> tuple[Any, ...]:
    """Return what the law hands back at reset, at each instant, and from its inner loop."""
    state = law.reset(*instants[0])
    found = [state]
    for number, (seen, wanted) in enumerate(instants):
        state, command, signals = law.step(state, number * period, seen, wanted)
        found += [state, command, signals]
        if hasattr(law, "inner"):
            state, inner = law.inner(state, number * period, command, seen)
            found += [state, inner]
    return tuple(found)


UNWINDS = {"quaternion_feedback:Fixed"}
"""Laws to which q and -q are two attitudes: it is what they are there to show."""

every_law = pytest.mark.parametrize("kind", laws())


def test_they_are_found() -> None:
    assert len(laws()) >= 33
    assert {"contraction:Ideal", "lander:VariableStructure", "phases:Phases"} <= set(laws())


@every_law
def test_it_is_a_pure_function(kind: str) -> None:
    law, period, instants = inputs(kind)
    first = outcome(law, period, instants)
    assert same(first, outcome(law, period, instants))
    _, command, _ = law.step(first[0], 0.0, *instants[0])
    assert all(np.isfinite(leaf).all() for leaf in leaves(command))
    # from a state that nobody may write to, which then is as it was
    state = first[0]
    before = [leaf.copy() for leaf in leaves(state)]
    for leaf in leaves(state):
        leaf.flags.writeable = False
    once, twice = (law.step(state, 0.0, *instants[0]) for _ in range(2))
    assert same(once, twice)
    assert all(np.array_equal(a, b) for a, b in zip(before, leaves(state), strict=True))
    # a sensor may write its next sample where the last one was
    kept = [array for seen, wanted in instants for array in (*seen._asdict().values(), *wanted)]
    assert not any(np.shares_memory(leaf, a) for leaf in leaves(first) for a in kept)


@every_law
def test_one_vehicle_alone_is_the_same_bits(kind: str) -> None:
    law, period, instants = inputs(kind)
    batch = leaves(outcome(law, period, instants))
    for index in range(COUNT):
        lone = [
            (seen._map(itemgetter(slice(index, index + 1))), wanted) for seen, wanted in instants
        ]
        alone = leaves(outcome(law, period, lone))
        for one, many in zip(alone, batch, strict=True):
            assert np.array_equal(
                one, many[index : index + 1] if many.size else many, equal_nan=True
            )


@every_law
def test_q_and_minus_q_are_one_attitude(kind: str) -> None:
    law, period, instants = inputs(kind)
    signs = np.array([[-1.0], [1.0], [-1.0], [1.0]])
    flipped = [(seen._replace(attitude=signs * seen.attitude), wanted) for seen, wanted in instants]
    state, other = law.reset(*instants[0]), law.reset(*flipped[0])
    for number, (here, there) in enumerate(zip(instants, flipped, strict=True)):
        state, command, _ = law.step(state, number * period, *here)
        other, turned, _ = law.step(other, number * period, *there)
        # a change of sign is exact in floating point
        assert same(command, turned) is (kind not in UNWINDS)
