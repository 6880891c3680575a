"""The charts of flights: the panels of the standard page, of several logs over each other."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mjspace.contract import Array
from mjspace.log.reader import Log
from mjspace.plotting.check_bounds import bounds
from mjspace.plotting.panels import Curves, Panel, chosen, curves
from mjspace.reporting.charts import Bound, Chart, Series
from mjspace.scenario.scenario import Check


def flight_charts(
    logs: Sequence[Log],
    names: Sequence[str],
    checks: Sequence[Sequence[Check]],
    signals: Sequence[str] = (),
) -> list[Chart]:
    """Return the panels of ``logs``, which go by ``names``, with the bounds of their ``checks``.

    Those are the standard page's, or one for each of ``signals``. A panel that several logs have
    has the curves of all.

    Raises:
        ValueError: a log has no such signal, or none at all.
    """
    panels: dict[tuple[str, str, str], list[tuple[int, Curves]]] = {}
    for number, log in enumerate(logs):
        for one in chosen(log, signals) if signals else curves(log):
            key = (one.panel.title, one.panel.unit, str(one.panel.part))
            panels.setdefault(key, []).append((number, one))
    return [_chart(found, logs, names, checks) for found in panels.values()]


def _chart(
    found: Sequence[tuple[int, Curves]],
    logs: Sequence[Log],
    names: Sequence[str],
    checks: Sequence[Sequence[Check]],
) -> Chart:
    panel = found[0][1].panel
    series: list[Series] = []
    marks: dict[tuple[object, ...], Bound] = {}
    for number, one in found:
        count = one.value.shape[1]
        again = number > found[0][0] and _same(one.desired, found[0][1].desired)
        shown = replace(one, desired=None) if again else one
        series += _series(shown, number, names[number] if len(logs) > 1 else "", len(logs))
        for bound in bounds(one.panel, checks[number], logs[number]):
            component = bound.component if one.panel.part is None else 0
            color = component if count > 1 else None
            mark = Bound(bound.text, (bound.start, bound.value), (bound.end, bound.value), color)
            marks.setdefault((bound.text, bound.value, bound.start, bound.end), mark)
    return Chart(
        panel.title, panel.unit, series, log_scale=panel.log_scale, bounds=list(marks.values())
    )


def _same(one: Array | None, other: Array | None) -> bool:
    """Return whether both are there, and equal: a desired value is drawn once."""
    return one is not None and other is not None and np.array_equal(one, other)


def _series(one: Curves, number: int, name: str, logs: int) -> list[Series]:
    """Return the lines of a log: components differ by color, logs by dashes, or else by color."""
    count = one.value.shape[1]
    found = []
    for i in range(count):
        component = _component(one.panel, i) if count > 1 else ""
        label = " ".join(part for part in (component, name) if part)
        color = i if count > 1 else (number if logs > 1 else None)
        dash = number if count > 1 else 0
        if one.desired is not None and one.desired_time is not None:
            time, value = one.desired_time[:, i], one.desired[:, i]
            found.append(Series(f"{label} desired".strip(), time, value, color, dash, desired=True))
        value = one.value[:, i]
        if one.panel.log_scale:
            value = np.where(value > 0.0, value, np.nan)
        found.append(Series(label, one.time[:, i], value, color, dash))
    return found


def _component(panel: Panel, number: int) -> str:
    return panel.names[number] if number < len(panel.names) else str(number)
