"""What flew in a log, assembled again from the log alone."""

import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mjspace.errors import input_error_at
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.runner import scratch
from mjspace.runner.logged_code import (
    code_of,
    model_files,
    refuse_connection,
    require_trust,
    unpack,
)
from mjspace.scenario.scenario import Component, Scenario
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.vehicle import vehicle
from mjspace.vehicle.logged_model import logged_model


@contextmanager
def assembly_of(
    log: Log, law: Component | None = None, folder: Path = Path(), *, trust: bool = False
) -> Iterator[Assembly]:
    """Yield the assembly that flew in ``log``, or the same under another ``law``.

    The scenario, the compiled model and the user's files all come from the log. They run with
    ``trust`` alone.

    Raises:
        InputError: the log lacks one of them, or they are not trusted; the law cannot be built, or
            another version packed the environment into the state differently.
    """
    with input_error_at("log"):
        scenario = scenario_of(log)
    if law is not None:
        scenario = _without_signals_of_the_law(scenario).model_copy(update={"law": law})
    with input_error_at("log"):
        code = code_of(log, scenario, law=law is None)
        model = model_files(log, scenario)
    if not trust:
        require_trust(code)
        if law is None:
            refuse_connection(scenario)
    with scratch.folder() as own:
        unpack(code | model, own)
        law_folder = None if law is None else folder
        assembly = assemble(scenario, own, trust=trust, law_folder=law_folder)
        flown = logged_model(
            assembly.vehicle.model,
            log.attachment("model.mjb.gz"),
            log.metadata,
            log.shape("/state", "physics"),
        )
        yield dataclasses.replace(assembly, vehicle=vehicle.on_model(assembly.vehicle, flown))


def _without_signals_of_the_law(scenario: Scenario) -> Scenario:
    """Return the scenario without what looks at signals that another law may lack."""

    def is_free(*signals: str) -> bool:
        return not any(signal.startswith("law.") for signal in signals)

    events = [event for event in scenario.events if is_free(event.signal, *event.shows)]
    kept = {None, *(event.name for event in events)}
    checks = [
        c
        for c in scenario.checks
        if is_free(c.signal, *(c.signals or {}).values()) and {c.since, c.until} <= kept
    ]
    metrics = [
        m
        for m in scenario.metrics
        if is_free(m.signal or "", *m.signals) and {m.since, m.until} <= kept
    ]
    return scenario.model_copy(update={"events": events, "checks": checks, "metrics": metrics})
