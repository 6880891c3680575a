"""Flies the benchmarks: nominally, with other integrators, at other steps, with injected faults."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from mjspace.log.provenance import software
from mjspace.runner import workers
from mjspace.validation import benchmarks
from mjspace.validation.benchmark import (
    FAULTS,
    Benchmark,
    Bound,
    Conditions,
    Fault,
    Readings,
)
from mjspace.validation.results import Injected, Line, Results, Row, Section

ORDER, ORDER_ALLOWED = 4.0, 0.1
"""RK4's order of convergence, and the allowed deviation of an observed one."""
_EVERYWHERE: tuple[Fault, ...] = ("armature", "integrator", "held", "inertia")

Flight = tuple[Benchmark, Conditions]


def chosen(names: Sequence[str]) -> list[Benchmark]:
    """Return the benchmarks with these names; all benchmarks if there are no names.

    Raises:
        ValueError: a name is unknown; the message lists the known ones.
    """
    known = {benchmark.name: benchmark for benchmark in benchmarks.ALL}
    for name in names:
        if name not in known:
            raise ValueError(f"no benchmark {name!r}: have {', '.join(known)}")
    return [known[name] for name in known if not names or name in names]


def validate(
    selected: Sequence[Benchmark],
    *,
    quick: bool = False,
    progress: Callable[[float], None] = lambda done: None,
    fly_all: Callable[[Sequence[Flight]], Iterable[tuple[Flight, Readings]]] | None = None,
) -> Results:
    """Fly all conditions of the benchmarks and judge them.

    ``quick`` flies each benchmark once, short. ``progress`` is called with the fraction done.
    ``fly_all`` yields flights with their readings, in any order; the default uses every core.
    """
    planned = [(b, c) for b in selected for c in _plan(b, quick)]
    # The longest flights begin first, so that all cores end at nearly the same time.
    planned.sort(key=lambda flight: flight[1].short)
    flown: dict[tuple[str, Conditions], Readings] = {}
    for (benchmark, conditions), readings in (fly_all or on_every_core)(planned):
        flown[benchmark.name, conditions] = readings
        progress(len(flown) / len(planned))
    return Results(
        versions=software(),
        quick=quick,
        sections=[
            _section(b, {c: flown[b.name, c] for c in _plan(b, quick)}, quick) for b in selected
        ],
    )


def on_every_core(planned: Sequence[Flight]) -> Iterator[tuple[Flight, Readings]]:
    """Yield each flight with its readings as soon as it is done."""
    for index, readings in workers.each([(b.fly, c) for b, c in planned]):
        yield planned[index], readings


def _nominal(benchmark: Benchmark, quick: bool) -> Conditions:
    return Conditions(benchmark.step, short=quick)


def _plan(benchmark: Benchmark, quick: bool) -> Iterator[Conditions]:
    nominal = _nominal(benchmark, quick)
    yield nominal
    if quick:
        return
    for integrator in benchmark.others:
        yield replace(nominal, integrator=integrator)
    for step in benchmark.order.steps if benchmark.order else ():
        yield Conditions(step, short=True)
    for fault in _injectable(benchmark):
        yield replace(nominal, fault=fault, short=True)


def _injectable(benchmark: Benchmark) -> list[Fault]:
    return [fault for fault in FAULTS if fault in _EVERYWHERE or fault in benchmark.catches]


def _section(benchmark: Benchmark, flown: dict[Conditions, Readings], quick: bool) -> Section:
    nominal = _nominal(benchmark, quick)
    readings = flown[nominal]
    others = {} if quick else {i: flown[replace(nominal, integrator=i)] for i in benchmark.others}
    rows = [
        Row.judged(
            bound,
            readings.values[bound.quantity],
            {name: other.values[bound.quantity] for name, other in others.items()},
        )
        for bound in benchmark.bounds
    ]
    if benchmark.order and not quick:
        at = {step: flown[Conditions(step, short=True)] for step in benchmark.order.steps}
        rows += [_order(quantity, at) for quantity in benchmark.order.quantities]
    return Section(
        name=benchmark.name,
        title=benchmark.title,
        shows=benchmark.shows,
        source=benchmark.source,
        step=benchmark.step,
        rows=rows,
        faults=[]
        if quick
        else [
            _injected(benchmark, fault, flown[replace(nominal, fault=fault, short=True)])
            for fault in _injectable(benchmark)
        ],
        x_label=readings.motion.x_label,
        y_label=readings.motion.y_label,
        motion=[Line.of(curve) for curve in readings.motion.curves],
        error_label=readings.error.label,
        errors={"RK4": Line.of(readings.error)}
        | {name: Line.of(other.error) for name, other in others.items()},  # type: ignore[arg-type]
    )


def _order(quantity: str, at: dict[float, Readings]) -> Row:
    steps = list(at)
    errors = [readings.values[quantity] for readings in at.values()]
    usable = all(0.0 < error < np.inf for error in errors)
    slope = float(np.polyfit(np.log(steps), np.log(errors), 1)[0]) if usable else np.nan
    reason = f"RK4's order: the slope over steps of {', '.join(f'{step:g}' for step in steps)} s"
    return Row.judged(Bound(f"order of {quantity}", "", ORDER_ALLOWED, reason, ORDER), slope)


def _injected(benchmark: Benchmark, fault: Fault, readings: Readings) -> Injected:
    return Injected(
        fault=fault,
        meaning=benchmark.catches.get(fault) or FAULTS[fault],
        expected=fault in benchmark.catches,
        broken=[b.quantity for b in benchmark.bounds if not b.admits(readings.values[b.quantity])],
    )
