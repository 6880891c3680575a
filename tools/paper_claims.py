"""What the five papers claim: the entries of tools/papers/, and the flights that measure them."""

import re
import tomllib
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self, get_args

from pydantic import BaseModel, ConfigDict, model_validator

from mjspace.log.reader import Log
from mjspace.plotting.panels import unit
from mjspace.runner.checks import Verdict
from mjspace.runner.output import LOG
from mjspace.runner.run import fly_to_log
from mjspace.scenario.loading import load
from mjspace.scenario.scenario import Check
from mjspace.signals import find_signal
from mjspace.simulation.assembly import assemble

Verdicts = Literal["holds", "holds corrected", "does not hold", "not flown"]
VERDICTS = get_args(Verdicts)
FILES = sorted((Path(__file__).parent / "papers").glob("*.toml"))
_UNIT = re.compile(r" \[([^]]*)\]$")


class Entry(BaseModel):
    """What is common to all that tools/papers/ holds."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Number(NamedTuple):
    """What was measured, as the page shows it."""

    signal: str
    value: str


class Flight(Entry):
    """A scenario with changes."""

    scenario: str
    set: list[str]
    """As ``--set`` takes them."""


class Measured(Entry):
    """A check of a flight, and how the page names it."""

    flight: str
    name: str
    """What was measured; a unit in brackets at its end is that of the value."""
    check: str | None = None
    """Name of one of the scenario's checks; ``stated`` when left out."""
    stated: Check | None = None
    digits: int = 3
    """Of the value, as shown."""

    @model_validator(mode="before")
    @classmethod
    def _stated_or_named(cls, entry: dict[str, Any]) -> dict[str, Any]:
        if "check" in entry:
            return {"name": entry["check"], **entry}
        kept = {key: entry[key] for key in ("flight", "name", "digits") if key in entry}
        stated = {key: entry[key] for key in entry if key not in ("flight", "digits")}
        return {**kept, "stated": stated}

    @property
    def title(self) -> str:
        """The name without its unit."""
        return _UNIT.sub("", self.name)

    def judged(self, scenarios_own: Sequence[Check]) -> Check:
        """Return the check that is judged.

        Raises:
            ValueError: the scenario has no check of that name, or several.
        """
        if self.stated is not None:
            return self.stated
        found = [check for check in scenarios_own if check.name == self.check]
        if len(found) != 1:
            raise ValueError(f"{self.flight} has {len(found)} checks {self.check!r}")
        return found[0]


class Claim(Entry):
    """A row."""

    claim: str
    where: str
    verdict: Verdicts
    because: str = ""
    measured: list[Measured] = []
    errata: list[str] = []

    @model_validator(mode="before")
    @classmethod
    def _flight_of_all(cls, entry: dict[str, Any]) -> dict[str, Any]:
        flight = entry.pop("flight", None)
        each = [{"flight": flight, **one} for one in entry.get("measured", [])]
        return {**entry, "measured": each}

    @model_validator(mode="after")
    def _measured_if_flown(self) -> Self:
        if (self.verdict == "not flown") != (not self.measured):
            raise ValueError(f"{self.claim!r}: {self.verdict} with {len(self.measured)} numbers")
        if self.verdict != "holds" and not self.because:
            raise ValueError(f"{self.claim!r}: {self.verdict} needs because")
        return self


class Curve(Entry):
    """A signal over time, or over another one."""

    flight: str
    y: str
    x: str | None = None
    labels: list[str] = []
    color: Literal["red", "black", "blue"] | None = None
    faint: bool = False
    """Drawn wide and pale, as what is desired."""
    si: bool = False
    """In the log's unit, not that of plots."""


class Panel(Entry):
    """One pair of axes."""

    title: str
    curves: list[Curve]
    start: float = 0.0
    end: float | None = None
    log: bool = False
    running: bool = False
    """Drawn is the root of the integral of the square, from the flight's beginning on."""
    levels: list[float] = []


class Picture(Entry):
    """A file of panels."""

    file: str
    caption: str
    panels: list[Panel]


class Paper(Entry):
    """A file of tools/papers/."""

    title: str
    source: str
    remark: str
    flights: dict[str, Flight] = {}
    claims: list[Claim]
    errata: dict[str, str]
    figures: list[Picture]

    @model_validator(mode="after")
    def _nothing_is_loose(self) -> Self:
        cited = {erratum for claim in self.claims for erratum in claim.errata}
        if loose := cited ^ set(self.errata):
            raise ValueError(f"errata that are cited or stated, not both: {loose}")
        if unused := set(self.flights) - set(self.shown):
            raise ValueError(f"flights of which nothing is shown: {unused}")
        return self

    @property
    def measured(self) -> dict[str, list[Measured]]:
        """What is measured, by flight."""
        found: dict[str, list[Measured]] = {}
        for one in (one for claim in self.claims for one in claim.measured):
            found.setdefault(one.flight, []).append(one)
        return found

    @property
    def shown(self) -> list[str]:
        """The flights of which something is measured or drawn, each once."""
        panels = [panel for picture in self.figures for panel in picture.panels]
        drawn = [curve.flight for panel in panels for curve in panel.curves]
        return list(dict.fromkeys([*self.measured, *drawn]))

    def flight(self, name: str) -> Flight:
        """Return the flight of that name, or of that scenario."""
        return self.flights.get(name) or Flight(scenario=name, set=[])


def papers() -> list[Paper]:
    """Return the papers, in the order of their files.

    Raises:
        ValueError: an entry that is not as above, with its file.
    """
    found = []
    for path in FILES:
        try:
            found.append(Paper.model_validate(tomllib.loads(path.read_text())))
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from error
    return found


def fly(call: tuple[Flight, Sequence[Measured], Path]) -> list[Number]:
    """Fly into the folder, and return what was measured.

    Raises:
        ValueError: the flight ended early, or a check did not come out as it is expected.
    """
    flight, measured, folder = call
    with warnings.catch_warnings(action="ignore"):
        scenario, home = load(flight.scenario, flight.set)
        checks = [one.judged(scenario.checks) for one in measured]
        judged = scenario.model_copy(update={"checks": checks})
        result = fly_to_log(assemble(judged, home), folder / LOG)
    verdicts = result.verdicts[: len(checks)]
    if wrong := [verdict.line for verdict in verdicts if not verdict.as_expected]:
        raise ValueError(f"{flight}: {result.trouble or wrong}")
    return [
        Number(verdict.check.signal, _shown(one, verdict, result.log))
        for one, verdict in zip(measured, verdicts, strict=True)
    ]


def _shown(one: Measured, verdict: Verdict, log: Log) -> str:
    """Return a value as the page shows it: ``1950 N m``."""
    check, name, scale = verdict.check, "", 1.0
    if named := _UNIT.search(one.name):
        name = named[1]
    elif not check.relative:
        topic, field, _ = find_signal(log.topics, check.signal)
        name, scale = unit(log, topic, field).displayed
    digits = f"{scale * verdict.measured:.{one.digits}g}"
    return f"{float(digits):.{one.digits + 3}g} {name}".strip()
