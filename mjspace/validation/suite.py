"""Flies the benchmarks: as they should be, under other integrators, at other steps, with faults."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context

import numpy as np

from mjspace.provenance import software
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
"""RK4's order of convergence, and how far from it an observed one may be."""
_EVERYWHERE: tuple[Fault, ...] = ("armature", "integrator", "held", "inertia")

Flights = dict[tuple[str, Conditions], Readings]


def chosen(names: Sequence[str]) -> list[Benchmark]:
    """Return the benchmarks of those names; all of them for none.

    Raises:
        ValueError: no such benchmark; the message names those that there are.
    """
    known = {benchmark.name: benchmark for benchmark in benchmarks.ALL}
    for name in names:
        if name not in known:
            raise ValueError(f"no benchmark {name!r}: have {', '.join(known)}")
    return [known[name] for name in known if not names or name in names]


def validate(
    wanted: Sequence[Benchmark],
    *,
    quick: bool = False,
    progress: Callable[[float], None] = lambda done: None,
) -> Results:
    """Fly all that the benchmarks ask for, on every core, and judge it.

    ``quick`` flies each benchmark once, short. ``progress`` is told the fraction done.
    """
    flights: Flights = {}
    planned = [(b.name, c) for b in wanted for c in _plan(b, quick)]
    # The first of a plan is the longest: begun first, it does not keep the others waiting.
    planned.sort(key=lambda flight: flight[1].short)
    workers = min(os.cpu_count() or 1, len(planned))
    # A fresh process each, for callbacks are global and threads do not survive a fork.
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        futures = {pool.submit(_fly, *flight): flight for flight in planned}
        try:
            for count, future in enumerate(as_completed(futures), start=1):
                flights[futures[future]] = future.result()
                progress(count / len(planned))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return Results(
        versions=software(),
        quick=quick,
        sections=[_section(benchmark, flights, quick) for benchmark in wanted],
    )


def _fly(name: str, conditions: Conditions) -> Readings:
    (benchmark,) = chosen([name])
    return benchmark.fly(conditions)


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


def _section(benchmark: Benchmark, flights: Flights, quick: bool) -> Section:
    nominal = _nominal(benchmark, quick)

    def flown(conditions: Conditions) -> Readings:
        return flights[benchmark.name, conditions]

    others = {} if quick else {i: flown(replace(nominal, integrator=i)) for i in benchmark.others}
    rows = [
        Row(
            quantity=bound.quantity,
            unit=bound.unit,
            measured=flown(nominal).values[bound.quantity],
            target=bound.target,
            allowed=bound.allowed,
            reason=bound.reason,
            passed=bound.admits(flown(nominal).values[bound.quantity]),
            others={name: other.values[bound.quantity] for name, other in others.items()},
        )
        for bound in benchmark.bounds
    ]
    if benchmark.order and not quick:
        at = {step: flown(Conditions(step, short=True)) for step in benchmark.order.steps}
        rows += [_order(quantity, at) for quantity in benchmark.order.quantities]
    motion = flown(nominal).motion
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
            _injected(benchmark, fault, flown(replace(nominal, fault=fault, short=True)))
            for fault in _injectable(benchmark)
        ],
        x_label=motion.x_label,
        y_label=motion.y_label,
        motion=[Line.of(curve) for curve in motion.curves],
        error_label=flown(nominal).error.label,
        errors={"RK4": Line.of(flown(nominal).error)}
        | {name: Line.of(other.error) for name, other in others.items()},  # type: ignore[arg-type]
    )


def _order(quantity: str, at: dict[float, Readings]) -> Row:
    steps = list(at)
    errors = [readings.values[quantity] for readings in at.values()]
    slope = float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
    bound = Bound(
        f"order of {quantity}",
        "",
        ORDER_ALLOWED,
        f"RK4's order, as the slope over steps of {', '.join(f'{step:g}' for step in steps)} s",
        ORDER,
    )
    return Row(
        quantity=bound.quantity,
        unit="",
        measured=slope,
        target=bound.target,
        allowed=bound.allowed,
        reason=bound.reason,
        passed=bound.admits(slope),
    )


def _injected(benchmark: Benchmark, fault: Fault, readings: Readings) -> Injected:
    return Injected(
        fault=fault,
        meaning=benchmark.catches.get(fault) or FAULTS[fault],
        wanted=fault in benchmark.catches,
        broken=[b.quantity for b in benchmark.bounds if not b.admits(readings.values[b.quantity])],
    )
