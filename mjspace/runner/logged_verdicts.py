"""The verdicts of a flight that was judged as it flew, read back from its log."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from mjspace.contract import Event
from mjspace.log.reader import Log
from mjspace.runner.checks import NO_CRASH, Verdict
from mjspace.runner.metrics import LINE
from mjspace.scenario.scenario import Check, Scenario

NO_VERDICT = "the log has no verdict on it"
_NUMBER = re.compile(r"(\S+) \(required ")


@dataclass(frozen=True)
class Judged:
    """What a log says of its flight."""

    verdicts: list[Verdict]
    metrics: list[str]
    """What each metric came to, as ``Measured.line`` wrote it."""
    trouble: str
    """Why it ended early; empty for a flight that reached its end."""
    events: list[Event]
    """Without the lines of the verdicts and the metrics."""

    @property
    def passed(self) -> bool:
        """Whether it reached its end and every check came out as expected."""
        return not self.trouble and all(verdict.as_expected for verdict in self.verdicts)


def judged(log: Log, scenario: Scenario) -> Judged:
    """Return the verdicts that the log's last lines are, as ``Verdict.line`` wrote them.

    The flight was judged on every control period; the log may have fewer rows. Of the measured
    numbers there are six digits.

    Raises:
        InputError: a chunk of the log is damaged.
    """
    events = log.events()
    checks = list(scenario.checks)
    over_ground = "crash" in log.topics.get("/truth", {})
    if over_ground and all(check.signal != NO_CRASH.signal for check in checks):
        checks.append(NO_CRASH)
    at = max(len(events) - len(checks), 0)
    lines = [event.message for event in events[at:]]
    found = [_verdict(check, line) for check, line in zip(checks, lines, strict=False)]
    verdicts = [verdict for verdict in found if verdict is not None]
    if len(verdicts) < len(checks):  # killed as it flew, before anything was judged
        verdicts, at = [Verdict(check, math.nan, NO_VERDICT) for check in checks], len(events)
    first = max(at - len(scenario.metrics), 0)
    metrics = [event.message for event in events[first:at] if event.message.startswith(LINE)]
    at -= len(metrics)
    return Judged(verdicts, metrics, _trouble(log, scenario, events[:at]), events[:at])


def _verdict(check: Check, line: str) -> Verdict | None:
    """Return what the line says of the check; None where it says nothing."""
    for outcome in ("PASS", "FAIL", "not measured"):
        start = f"{outcome} {check.name}: "
        if not line.startswith(start):
            continue
        rest = line.removeprefix(start)
        if outcome == "not measured":
            return Verdict(check, math.nan, rest)
        number = _NUMBER.match(rest)
        try:
            return Verdict(check, _measured(check, outcome, number[1] if number else ""))
        except ValueError:
            return None
    return None


def _measured(check: Check, outcome: str, text: str) -> float:
    """Return the number; where its six digits are those of a bound, on the side that was judged."""
    measured = float(text)
    for bound, inside in ((check.below, -math.inf), (check.above, math.inf)):
        if bound is not None and f"{bound:.6g}" == text:
            return math.nextafter(float(bound), inside if outcome == "PASS" else -inside)
    return measured


def _trouble(log: Log, scenario: Scenario, events: Sequence[Event]) -> str:
    if log.end > scenario.duration - 0.5 * log.control_period:
        return ""
    why = [event.message for event in events if event.level == "ERROR"]
    return why[-1] if why else f"the log ends at {log.end:.6g} s of {scenario.duration:.6g} s"
