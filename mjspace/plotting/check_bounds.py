"""The bounds of a scenario's checks, as lines over their windows on the panel of their signal."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from mjspace.log.reader import Log
from mjspace.plotting.panels import Panel
from mjspace.scenario.scenario import Check
from mjspace.signals import find_signal

_NARROW = 0.3  # of the upper bound
_SHORTEST = 0.05  # of the log: length of a bound on one instant, to be visible


@dataclass(frozen=True)
class Bound:
    """A horizontal line."""

    text: str
    value: float
    """In the panel's unit."""
    start: float
    """Of the window [s]."""
    end: float
    upper: bool
    """Whether what is judged must stay below it."""
    component: int
    """Of the signal's."""


def bounds(panel: Panel, checks: Sequence[Check], log: Log) -> Iterator[Bound]:
    """Yield the bounds that can be drawn on ``panel``.

    Those of another signal or of a formula cannot, nor those of an error from a target, of a
    vector's norm, in a window counted from an event, and of a drift from a later instant than the
    panel's.
    """
    for check in checks:
        if check.formula is not None:
            continue
        topic, field, part = find_signal(log.topics, check.signal)
        component = part.start
        is_drift = check.statistic == "drift"
        if (
            (topic, field) != (panel.topic, panel.field)
            or panel.part not in (None, part)
            or check.target is not None
            or check.since is not None
            or check.until is not None
            or is_drift != panel.drift
            or (is_drift and check.start > log.start)
            or not (is_drift or part.stop - part.start == 1)
        ):
            continue
        end = log.end if check.end is None else min(check.end, log.end)
        start = end if check.statistic == "final" else min(check.start, end)
        start = min(start, end - _SHORTEST * (log.end - log.start))
        for text, limit, upper in _limits(check, panel.scale):
            yield Bound(text, limit, start, end, upper, component)
            if check.statistic == "peak":
                yield Bound(text, -limit, start, end, not upper, component)


def _limits(check: Check, scale: float) -> Iterator[tuple[str, float, bool]]:
    """Yield the check's bounds: text, value in the panel's unit, and whether it is an upper one.

    Two that are too near each other for two texts have one.
    """
    below, above = check.below, check.above
    if below is not None and above is not None and below - above < _NARROW * abs(below):
        yield f"{check.statistic} {scale * above:.4g} to {scale * below:.4g}", scale * below, True
        yield "", scale * above, False
        return
    for sign, limit in (("<", below), (">", above)):
        if limit is not None:
            yield f"{check.statistic} {sign} {scale * limit:.4g}", scale * limit, sign == "<"
