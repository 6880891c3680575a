"""The report of logs: their flights with the verdicts, as one HTML file."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from mjspace.log import topics
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.reporting import flight
from mjspace.reporting.flight import CheckRow, Flight
from mjspace.runner.checks import Verdict, margin
from mjspace.runner.logged_verdicts import judged
from mjspace.runner.metrics import LINE
from mjspace.scenario.scenario import Check
from mjspace.signals import find_signal
from mjspace.units import Unit


def write(
    logs: Sequence[Log | Path | str],
    output: Path | str,
    *,
    signals: Sequence[str] = (),
    video: bool = False,
    progress: Callable[[int, int], None] = lambda drawn, count: None,
) -> None:
    """Write the report of a log, or a comparison of several, to one HTML file.

    It opens without a network: plots and pictures are in it. The signals are those of the standard
    page of ``mjspace.plotting``, or ``signals``, named as in a check. No log is loaded whole.

    Raises:
        ValueError: ``output`` does not end in .html, no such signal, or not a log of mjspace.
        OSError: a file cannot be read or written.
    """
    flights = [_flight(Log.of(log)) for log in logs]
    flight.write(flights, Path(output), signals=signals, video=video, progress=progress)


def _flight(log: Log) -> Flight:
    log.require_periods()
    scenario = scenario_of(log)
    found = judged(log, scenario)
    rows = [_row(log, verdict) for verdict in found.verdicts]
    lines = [line.removeprefix(LINE) for line in found.metrics]
    return Flight(log, scenario, rows, lines, found.passed, found.trouble, found.events)


def _row(log: Log, verdict: Verdict) -> CheckRow:
    """Return what is shown of a verdict, in the unit in which a person reads the signal."""
    check = verdict.check
    unit, scale = _unit(log, check)
    left = margin(check, verdict.measured)

    def number(value: float) -> str:
        return "-" if math.isnan(value) else f"{scale * value:.4g} {unit}".strip()

    bounds = (("<", check.below), (">", check.above))
    outcome: str = verdict.outcome
    if check.expected == "FAIL":
        outcome += " as expected" if verdict.as_expected else ", expected FAIL"
    return CheckRow(
        name=check.name,
        requirement=check.requirement,
        claim=_claim(check),
        measured=number(verdict.measured),
        bound=" and ".join(
            f"{sign} {scale * bound:.6g} {unit}".strip()
            for sign, bound in bounds
            if bound is not None
        ),
        margin=number(left),
        outcome=outcome,
        as_expected=verdict.as_expected,
        note=verdict.missing or check.because,
    )


def _unit(log: Log, check: Check) -> tuple[str, float]:
    """Return the unit of the check's number as it is displayed, and the factor from SI to it."""
    if check.relative or check.formula:
        return "", 1.0
    try:
        topic, field, _ = find_signal(log.topics, check.signal)
    except ValueError:  # of a log whose topics are not those of its flight
        return "", 1.0
    si = log.units[topic].get(field, "")
    declared = topics.units().get(topic, {}).get(field, Unit(si))
    return (declared if declared.si == si else Unit(si)).displayed


def _claim(check: Check) -> str:
    """Return what is measured: the statistic, the signal and the window."""
    claim = check.formula or f"{check.statistic} of {check.signal}"
    if check.target is not None:
        claim += f" less {check.target}" + (", relative" if check.relative else "")
    begins = f"from {check.start:g} s" if check.statistic != "final" and check.start else ""
    ends = "" if check.end is None else f"to {check.end:g} s"
    if begins and check.start == check.end:
        begins, ends = f"at {check.start:g} s", ""
    after = f"after {check.since!r}" if check.since else ""
    window = (begins, "on" if begins and check.end is None else ends, after)
    if any(window):
        claim += f", {' '.join(filter(None, window))}"
    if check.until:
        claim += f", until {check.until!r}"
    return claim
