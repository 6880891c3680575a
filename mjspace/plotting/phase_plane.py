"""Two signals of a log against each other: a phase plane, and when which thrusters fired."""

import textwrap
from collections.abc import Mapping
from functools import reduce
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mjspace.contract import Array
from mjspace.errors import whole_or_none
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.plotting.panels import unit
from mjspace.plotting.style import COLORS, FAINT, INK, STYLE
from mjspace.signals import by_topic, find_signal

WIDTH, HEIGHT = 7.5, 6.0  # inches
GROUPS = 6
"""Number of groups of thrusters with a color of their own: those that fire together longest."""
_ARROWS = (0.12, 0.37, 0.62, 0.87)  # of the way


def plot(log: Log | Path | str, output: Path | str, x: str, y: str) -> None:
    """Write the phase plane of the signals ``x`` and ``y`` as PNG.

    Raises:
        ValueError: ``output`` does not end in .png, no such signal, or more than one number of it.
        OSError: a file cannot be read or written.
    """
    output = Path(output)
    if output.suffix != ".png":
        raise ValueError(f"output {str(output)!r}: end it in .png")
    with matplotlib.rc_context(STYLE):
        plane = figure(Log.of(log), x, y)
        with whole_or_none(output) as file:
            plane.savefig(file, dpi=130, facecolor="white")


def figure(log: Log, x: str, y: str) -> Figure:
    """Return the phase plane, as ``plot`` writes it but for the style.

    Where thrusters fired, the path has the color of those that did; dots are where that changed.
    """
    places = [_component(log, signal) for signal in (x, y)]
    fields = [(topic, field) for topic, field, _ in places]
    pulses = {"on_time", "thruster_thrust"} & log.topics.get("/command", {}).keys()
    fields += [("/command", field) for field in pulses]
    rows = _together(log.read_topics(by_topic(fields)))
    (across, x_label), (up, y_label) = (
        _values(log, rows, signal, place) for signal, place in zip((x, y), places, strict=True)
    )
    page = Figure(figsize=(WIDTH, HEIGHT))
    FigureCanvasAgg(page)
    axes = page.subplots()
    page.subplots_adjust(left=0.115, right=0.97, bottom=0.1, top=0.84)
    axes.axhline(0.0, color=FAINT, lw=0.7, zorder=1)
    axes.axvline(0.0, color=FAINT, lw=0.7, zorder=1)
    axes.plot(across, up, color=FAINT, lw=1.1, zorder=2, label="coast")
    if pulses:
        # One that is to be on, or a burn that goes on.
        firing = [rows["/command"][field] > 0.0 for field in pulses]
        _show_thrusters(axes, across, up, np.logical_or.reduce(firing))
    _show_direction(axes, across, up)
    axes.plot(across[:1], up[:1], "o", color=INK, mfc="white", ms=6.5, zorder=6, label="start")
    axes.plot(across[-1:], up[-1:], "s", color=INK, ms=5.0, zorder=6, label="end")
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=5, frameon=False, fontsize=8,
        handlelength=1.4, columnspacing=1.2,
    )  # fmt: skip
    scenario = scenario_of(log)
    page.text(0.02, 0.975, scenario.name, va="top", fontsize=13, fontweight="bold")
    description = textwrap.shorten(scenario.description, 115, placeholder=" ...")
    page.text(0.02, 0.928, description, va="top", color="#5b6470", fontsize=8.5)
    return page


def _component(log: Log, signal: str) -> tuple[str, str, int]:
    """Return the topic and field of the signal, and which of its numbers it is."""
    topic, field, part = find_signal(log.topics, signal)
    if part.stop - part.start != 1:
        raise ValueError(
            f"signal {signal!r} has {part.stop - part.start} numbers: pick one, as [0]"
        )
    return topic, field, part.start


def _together(rows: Mapping[str, Mapping[str, Array]]) -> dict[str, dict[str, Array]]:
    """Return the rows at the instants that every topic has: one may be logged less often."""
    common = reduce(np.intersect1d, (columns["time"] for columns in rows.values()))
    return {
        topic: {n: c[np.searchsorted(columns["time"], common)] for n, c in columns.items()}
        for topic, columns in rows.items()
    }


def _values(
    log: Log, rows: Mapping[str, Mapping[str, Array]], signal: str, place: tuple[str, str, int]
) -> tuple[Array, str]:
    """Return the signal's values (n,) in the displayed unit, and the label of their axis."""
    topic, field, number = place
    values = rows[topic][field].reshape(len(rows[topic]["time"]), -1)[:, number]
    name, scale = unit(log, topic, field).displayed
    return scale * values, f"{signal} [{name}]" if name else signal


def _show_thrusters(axes: Any, across: Array, up: Array, firing: Any) -> None:
    """Color the path by those of ``firing`` (n, thrusters) that are on; dot where they change."""
    groups, group = np.unique(firing, axis=0, return_inverse=True)
    group = group.reshape(-1)
    count = np.bincount(group, minlength=len(groups))
    fired = [int(g) for g in np.argsort(-count, kind="stable") if groups[g].any()]
    changes = np.flatnonzero(np.diff(group)) + 1
    color_of = np.full(len(groups), FAINT, dtype=object)
    shown = fired[:GROUPS] if len(fired) > GROUPS else fired
    names = ["thrusters " + ", ".join(map(str, np.flatnonzero(groups[g]))) for g in shown]
    for i, g in enumerate(shown):
        color_of[g] = COLORS[(0, 2, 1, 3, 4, 5)[i]]
    rest = [g for g in fired if g not in shown]
    color_of[rest] = COLORS[8]
    for members, name in [*(([g], n) for g, n in zip(shown, names, strict=True)), (rest, "others")]:
        if not members:
            continue
        on = np.isin(group, members)
        # A row's command acts until the next row.
        drawn = on | np.concatenate([[False], on[:-1]])
        line = np.where(drawn, across, np.nan), np.where(drawn, up, np.nan)
        axes.plot(*line, color=color_of[members[0]], lw=1.9, zorder=3, label=name)
    colors = [color_of[g] for g in group[changes]]
    size = 14.0 if len(changes) < 200 else 4.0
    axes.scatter(across[changes], up[changes], s=size, c=colors, zorder=4, linewidths=0)


def _show_direction(axes: Any, across: Array, up: Array) -> None:
    """Put arrowheads along the way, which is measured in parts of the picture."""
    spans = [np.ptp(values) or 1.0 for values in (across, up)]
    way = np.cumsum(np.hypot(np.diff(across) / spans[0], np.diff(up) / spans[1]))
    if not way.size or way[-1] == 0.0:
        return
    reach = 0.005 * way[-1]
    for part in _ARROWS:
        head = int(np.searchsorted(way, part * way[-1]))
        tail = int(np.searchsorted(way, max(part * way[-1] - reach, 0.0)))
        axes.annotate(
            "",
            (across[head + 1], up[head + 1]),
            (across[tail], up[tail]),
            arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 0.0, "shrinkA": 0, "shrinkB": 0},
            zorder=5,
        )
