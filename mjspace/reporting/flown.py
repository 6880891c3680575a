"""What was flown, as tables of keys and values: vehicle, environment, law, seed, versions."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from mjspace.errors import shortened
from mjspace.log.provenance import PACKAGES
from mjspace.log.reader import Log
from mjspace.scenario.scenario import Scenario

_ROWS = 40  # of a table; the whole scenario stands below them
_LONG = 120  # characters of a value


class Facts(NamedTuple):
    """A table with its title."""

    title: str
    rows: list[tuple[str, str]]


def facts(log: Log, scenario: Scenario) -> list[Facts]:
    """Return the tables about one flight: only what differs from the defaults, in SI units."""
    written = scenario.model_dump(mode="json", exclude_defaults=True)
    run = {
        "scenario": scenario.name,
        "seed": scenario.seed,
        "duration": f"{scenario.duration:g} s",
        "control period": f"{scenario.rates.control:g} s",
        "physics step": f"{scenario.rates.physics:g} s, {scenario.rates.integrator}",
        "flown": f"{log.start:g} to {log.end:g} s",
        "log": log.path.name,
    }
    known = ("mjspace", "git", "python", "platform", *PACKAGES, "started", "model_sha256")
    software = {key: log.metadata[key] for key in known if log.metadata.get(key)}
    tables = {
        "Vehicle": written.get("plant", {}),
        "Law": {"kind": scenario.law.kind, **scenario.law.gains},
        "Reference": {"kind": scenario.reference.kind, **scenario.reference.gains},
        "Initial state": written.get("initial", {}),
        "Environment": written.get("environment", {}),
        "Sensors": written.get("sensors", {}),
        "Faults": dict(enumerate(written.get("faults", []))),
        "Run": run,
        "Versions": software,
    }
    found = []
    for title, table in tables.items():
        rows = [row for row in _flat(table) if row[1] != "None"]
        more = len(rows) - _ROWS
        rows = rows[:_ROWS] + ([("...", f"{more} more, below")] if more > 0 else [])
        if rows:
            found.append(Facts(title, rows))
    return found


def _flat(table: Mapping[Any, Any], before: str = "") -> Iterator[tuple[str, str]]:
    for key, value in table.items():
        name = f"{before}{key}"
        if isinstance(value, Mapping):
            yield from _flat(value, f"{name}.")
        else:
            yield name, _text(value)


def _text(value: Any) -> str:
    if isinstance(value, list | tuple):
        text = f"[{', '.join(map(_text, value))}]"
    elif isinstance(value, float):
        text = f"{value:.6g}"
    else:
        text = str(value)
    return shortened(text, _LONG)
