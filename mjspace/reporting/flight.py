"""The report of a flight, or of several side by side."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mjspace.contract import Event
from mjspace.errors import InputError
from mjspace.log.reader import Log
from mjspace.reporting import page, pictures
from mjspace.reporting.flight_charts import flight_charts
from mjspace.reporting.flown import facts
from mjspace.scenario.scenario import Scenario

MOST = 6
"""Logs in a comparison: more dashes are not told apart."""
_EVENTS = 200


@dataclass(frozen=True)
class CheckRow:
    """A check and how it came out, as it is shown."""

    name: str
    requirement: str
    claim: str
    """Statistic, signal and window."""
    measured: str
    bound: str
    margin: str
    outcome: str
    as_expected: bool
    note: str
    """Why it is expected to fail, or why nothing was measured."""


@dataclass(frozen=True)
class Flight:
    """A log and what it came to."""

    log: Log
    scenario: Scenario
    checks: list[CheckRow]
    metrics: list[str]
    """What each metric came to, a line each."""
    passed: bool
    trouble: str
    events: list[Event]
    """Without the verdicts."""


def write(
    flights: Sequence[Flight],
    output: Path,
    *,
    signals: Sequence[str] = (),
    video: bool = False,
    progress: Callable[[int, int], None] = lambda drawn, count: None,
) -> None:
    """Write the report of one flight, or a comparison of several, as one HTML file.

    Each log is read a few times, one chunk at a time. ``video`` adds the video of each.

    Raises:
        ValueError: ``output`` does not end in .html; too many flights; or no such signal.
        OSError: a file cannot be read or written.
    """
    page.require_html(output)
    if not 1 <= len(flights) <= MOST:
        raise InputError(f"{len(flights)} logs: should be from 1 to {MOST}")
    logs = [flight.log for flight in flights]
    names = _names(flights)
    charts = flight_charts(logs, names, [f.scenario.checks for f in flights], signals)
    page.write(
        output,
        "flight.html.j2",
        charts,
        title=" and ".join(dict.fromkeys(f.scenario.name for f in flights)),
        flights=list(zip(names, flights, strict=True)),
        checks=_side_by_side(flights),
        tables=[facts(flight.log, flight.scenario) for flight in flights],
        toml=[log.attachment("scenario.toml").decode(errors="replace") for log in logs],
        stills=_stills(logs),
        videos=[pictures.video(log, progress) for log in logs] if video else [],
        events=[(flight.events[:_EVENTS], len(flight.events) - _EVENTS) for flight in flights],
        marks=_marks(flights),
    )


def _names(flights: Sequence[Flight]) -> list[str]:
    """Return names that tell the flights apart: of the scenario, of the folder, or a number."""
    for found in (
        [flight.scenario.name for flight in flights],
        [flight.log.path.absolute().parent.name for flight in flights],
        [flight.log.path.name for flight in flights],
    ):
        if all(found) and len(set(found)) == len(found):
            return found
    return [f"{number} {flight.scenario.name}" for number, flight in enumerate(flights, 1)]


def _side_by_side(flights: Sequence[Flight]) -> list[tuple[CheckRow, list[CheckRow | None]]]:
    """Return each check, as the first flight that has it shows it, and how it came out in each."""
    found: dict[tuple[str, str, str, int], list[CheckRow | None]] = {}
    for number, flight in enumerate(flights):
        seen: dict[tuple[str, str, str], int] = {}
        for row in flight.checks:
            same = (row.name, row.claim, row.bound)
            seen[same] = seen.get(same, 0) + 1
            found.setdefault((*same, seen[same]), [None] * len(flights))[number] = row
    return [(next(r for r in rows if r is not None), rows) for rows in found.values()]


def _stills(logs: Sequence[Log]) -> list[pictures.Picture]:
    """Return a still of each model that flew: the same model looks the same."""
    models = {log.metadata.get("model_sha256", str(log.path)): log for log in reversed(logs)}
    return [pictures.still(log) for log in reversed(models.values())]


def _marks(flights: Sequence[Flight]) -> list[dict[str, object]]:
    """Return the events as the charts mark them."""
    return [
        {"time": event.time, "level": event.level.lower()}
        for flight in flights
        for event in flight.events[:_EVENTS]
    ]
