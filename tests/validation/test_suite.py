"""The suite's judgement: what passes, what must fail, and that the same comes out every time."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from mjspace.validation import suite
from mjspace.validation.benchmark import (
    FAULTS,
    Benchmark,
    Bound,
    Conditions,
    Curve,
    Order,
    Picture,
    Readings,
)
from mjspace.validation.benchmarks import ALL
from mjspace.validation.results import Injected, Line, Results, Row

TIME = np.linspace(0.0, 1.0, 3)


def readings(error: float, rate: float) -> Readings:
    curve = Curve("x", TIME, error * TIME)
    return Readings({"error": error, "rate": rate}, Picture("t", "x", (curve,)), curve)


def fourth_order(conditions: Conditions) -> Readings:
    """Err as RK4 does, and by a lot with armature or under another integrator."""
    spoiled = conditions.fault == "armature" or conditions.integrator != "RK4"
    return readings(1.0 if spoiled else 1e-3 * conditions.step**4, 0.25)


def blind(conditions: Conditions) -> Readings:
    """Measure the same whatever happens."""
    return readings(0.0, 0.25)


def second_order(conditions: Conditions) -> Readings:
    return readings(1e-3 * conditions.step**2, 0.25)


def lost(conditions: Conditions) -> Readings:
    return readings(np.nan, 0.25)


FAKE = Benchmark(
    name="fake",
    title="A fake",
    shows="Nothing.",
    source="none",
    step=0.1,
    bounds=(
        Bound("error", "rad", 1e-6, "because"),
        Bound("rate", "rad/s", 0.01, "because", target=0.25),
    ),
    fly=fourth_order,
    catches={"armature": "a heavy joint"},
    order=Order(("error",), (0.4, 0.2, 0.1)),
    others=("Euler",),
)


def here(planned: Sequence[suite.Flight]) -> Iterator[tuple[suite.Flight, Readings]]:
    """Fly in this process: another takes seconds to start."""
    for benchmark, conditions in planned:
        yield (benchmark, conditions), benchmark.fly(conditions)


def validated(fly: Callable[[Conditions], Readings]) -> Results:
    return suite.validate([replace(FAKE, fly=fly)], fly_all=here)


def test_a_good_benchmark_passes_with_everything_measured() -> None:
    results = validated(fourth_order)
    assert results.passed
    (section,) = results.sections
    measured = {row.quantity: row.measured for row in section.rows}
    assert measured == pytest.approx({"error": 1e-7, "rate": 0.25, "order of error": 4.0})
    assert section.rows[0].others == {"Euler": 1.0}
    caught = {injected.fault: injected.broken for injected in section.faults}
    # what is not of this benchmark is not flown
    assert caught == {"armature": ["error"], "integrator": [], "held": [], "inertia": []}
    assert section.faults[0].meaning == "a heavy joint"


def test_a_benchmark_that_misses_its_fault_fails() -> None:
    (section,) = validated(blind).sections
    assert [row.passed for row in section.rows[:2]] == [True, True]
    assert [injected.fault for injected in section.missed] == ["armature"]
    assert not section.passed


def test_a_benchmark_that_only_misses_its_fault_fails_the_suite() -> None:
    """Everything that it measures is right; it is blind to armature alone."""
    results = suite.validate([replace(FAKE, fly=blind, order=None)], fly_all=here)
    (section,) = results.sections
    assert [row.passed for row in section.rows] == [True, True]
    assert not section.passed
    assert not results.passed
    # one that does not claim to catch it is not to blame
    silent = suite.validate([replace(FAKE, fly=blind, order=None, catches={})], fly_all=here)
    assert silent.passed


def test_one_section_that_fails_fails_the_suite_and_quick_misses_nothing() -> None:
    good, bad = replace(FAKE, name="good"), replace(FAKE, name="bad", fly=blind, order=None)
    for both in ([good, bad], [bad, good]):
        assert not suite.validate(both, fly_all=here).passed
        # no fault is flown, so none is missed
        assert suite.validate(both, quick=True, fly_all=here).passed
    wrong = replace(FAKE, fly=lambda conditions: readings(1.0, 0.25))
    assert not suite.validate([wrong], quick=True, fly_all=here).passed


def test_a_benchmark_that_raises_is_not_passed_over() -> None:
    def broken(conditions: Conditions) -> Readings:
        raise FloatingPointError(conditions.step)

    with pytest.raises(FloatingPointError):
        suite.validate([replace(FAKE, fly=broken)], fly_all=here)


def test_a_fault_is_caught_by_what_is_not_a_number_too() -> None:
    def diverging(conditions: Conditions) -> Readings:
        good = fourth_order(conditions)
        return readings(np.nan, 0.25) if conditions.fault else good

    (section,) = validated(diverging).sections
    assert section.faults[0].broken == ["error"]
    assert section.missed == []


@pytest.mark.parametrize("target", [0.0, 0.25])
def test_a_bound_admits_its_edges_and_nothing_beyond(target: float) -> None:
    bound = Bound("x", "", 0.125, "because", target)
    for side in (-1.0, 1.0):
        edge = target + side * 0.125
        assert bound.admits(edge)
        assert not bound.admits(edge + side * 1e-15)
    for nowhere in (np.nan, np.inf, -np.inf):
        assert not bound.admits(nowhere)


@pytest.mark.parametrize("error", [0.0, np.nan, np.inf])
def test_no_order_is_seen_in_errors_that_are_none(error: float) -> None:
    def flat(conditions: Conditions) -> Readings:
        measured = error if conditions.step == 0.2 else 1e-7
        return replace(readings(1e-7, 0.25), values={"error": measured, "rate": 0.25})

    row = validated(flat).sections[0].rows[-1]
    assert np.isnan(row.measured)
    assert not row.passed


def test_the_plan_is_flown_as_it_should_be() -> None:
    flown: list[Conditions] = []

    def noting(conditions: Conditions) -> Readings:
        flown.append(conditions)
        return fourth_order(conditions)

    told: list[float] = []
    suite.validate([replace(FAKE, fly=noting)], progress=told.append, fly_all=here)
    assert [c for c in flown if not c.short] == [
        Conditions(0.1),
        Conditions(0.1, integrator="Euler"),
    ]
    assert flown[0].short is False, "the longest first"
    assert {c.step for c in flown if c.short and c.fault is None} == {0.4, 0.2, 0.1}
    faults = [c.fault for c in flown if c.fault]
    assert faults == ["armature", "integrator", "held", "inertia"]
    assert all(c.step == 0.1 and c.short and c.integrator == "RK4" for c in flown if c.fault)
    assert told == pytest.approx(np.arange(1, len(flown) + 1) / len(flown))


def test_what_is_long_is_flown_before_what_is_short() -> None:
    """Of all benchmarks, not of each: a long flight begun last would keep everything waiting."""
    planned: list[Conditions] = []

    def noting(flights: Sequence[suite.Flight]) -> Iterator[tuple[suite.Flight, Readings]]:
        planned.extend(conditions for _, conditions in flights)
        yield from here(flights)

    suite.validate([FAKE, replace(FAKE, name="other")], fly_all=noting)
    assert [c.short for c in planned] == sorted(c.short for c in planned)
    assert [c.short for c in planned].count(False) == 4


@pytest.mark.parametrize(
    ("order", "passed"), [(3.0, False), (3.92, True), (4.08, True), (4.5, False), (5.0, False)]
)
def test_an_order_may_be_off_by_what_coarse_steps_do_to_it(order: float, passed: bool) -> None:
    """Between rounding and the limit of stability RK4 is seen within a tenth of four."""

    def fly(conditions: Conditions) -> Readings:
        return readings(1e-3 * conditions.step**order, 0.25)

    row = validated(fly).sections[0].rows[-1]
    assert row.measured == pytest.approx(order, rel=1e-12)
    assert row.passed is passed


def test_errors_above_one_have_an_order_as_well() -> None:
    def fly(conditions: Conditions) -> Readings:
        return readings(1e3 * conditions.step**4, 0.25)

    assert validated(fly).sections[0].rows[-1].measured == pytest.approx(4.0, rel=1e-12)


def test_a_wrong_order_fails() -> None:
    (section,) = validated(second_order).sections
    row = section.rows[-1]
    assert row.quantity == "order of error"
    assert row.measured == pytest.approx(2.0)
    assert not row.passed


def test_what_is_not_a_number_is_out_of_bounds() -> None:
    (section,) = validated(lost).sections
    assert not section.rows[0].passed
    assert section.rows[1].passed


def test_quick_flies_each_benchmark_once() -> None:
    told: list[float] = []
    results = suite.validate([FAKE], quick=True, progress=told.append, fly_all=here)
    assert told == [1.0]
    assert results.sections[0].faults == []
    assert [row.quantity for row in results.sections[0].rows] == ["error", "rate"]


def test_results_survive_json() -> None:
    results = validated(lost)
    again = Results.model_validate_json(results.model_dump_json())
    assert np.isnan(again.sections[0].rows[0].measured)
    assert again.model_dump_json() == results.model_dump_json()
    assert not again.passed


def test_what_the_results_say_of_themselves_is_written_and_never_believed() -> None:
    results = validated(fourth_order)
    told = json.loads(results.model_dump_json())
    assert told["passed"] is told["sections"][0]["passed"] is True
    assert [fault["caught"] for fault in told["sections"][0]["faults"]] == [True, *[False] * 3]
    told["sections"][0]["faults"][0]["broken"] = []
    again = Results.model_validate(told)
    assert not again.passed
    assert again.sections[0].missed[0].caught is False


def test_results_do_not_change() -> None:
    row = Row.judged(Bound("error", "rad", 1.0, "because"), 2.0)
    with pytest.raises(ValidationError, match="frozen"):
        row.passed = True
    assert not row.passed


def test_a_curve_is_kept_with_six_digits_and_as_what_it_is() -> None:
    third = np.array([1.0 / 3.0, 2e7 / 3.0])
    for dots in (False, True):
        kept = Line.of(Curve("w", third, -third, dots))
        assert kept == Line(
            label="w", x=[0.333333, 6666670.0], y=[-0.333333, -6666670.0], dots=dots
        )
    assert not Line(label="w", x=[0.0], y=[0.0]).dots, "a line where nothing is said"


def test_only_what_is_named_is_chosen() -> None:
    names = [benchmark.name for benchmark in ALL]
    assert [b.name for b in suite.chosen([])] == names
    assert len(set(names)) == len(names)
    assert [b.name for b in suite.chosen([names[1], names[0]])] == names[:2]
    with pytest.raises(ValueError, match=f"no benchmark 'nope': have {names[0]}"):
        suite.chosen(["nope"])


@pytest.mark.parametrize("benchmark", ALL, ids=lambda benchmark: benchmark.name)
def test_a_benchmark_is_written_in_full(benchmark: Benchmark) -> None:
    assert benchmark.catches, "a benchmark that catches nothing proves nothing"
    assert set(benchmark.catches) <= set(FAULTS)
    for fault in ("sign", "erratum"):
        assert benchmark.catches.get(fault, "what it is"), fault
    for bound in benchmark.bounds:
        assert bound.reason
        assert bound.allowed >= 0.0
    quantities = {bound.quantity for bound in benchmark.bounds}
    assert not benchmark.order or set(benchmark.order.quantities) <= quantities
    steps = benchmark.order.steps if benchmark.order else (4.0, 2.0, 1.0)
    assert len(steps) >= 3
    np.testing.assert_allclose(np.diff(np.log2(steps)), -1.0)


def test_a_flight_is_the_same_every_time() -> None:
    wanted = suite.chosen(["torque-free"])
    once = suite.validate(wanted, quick=True)  # in processes of its own
    again = suite.validate(wanted, quick=True, fly_all=here)
    assert once.model_dump_json() == again.model_dump_json()


@pytest.mark.slow
def test_every_benchmark_holds_and_catches_exactly_what_it_claims() -> None:
    results = suite.validate(suite.chosen([]))
    for section in results.sections:
        assert [row for row in section.rows if not row.passed] == []
        assert [i for i in section.faults if i.expected != bool(i.broken)] == [], section.name
    assert results.passed
    injected: list[Injected] = [i for section in results.sections for i in section.faults]
    for fault in FAULTS:
        assert any(i.fault == fault and i.broken for i in injected), f"nobody catches {fault}"
