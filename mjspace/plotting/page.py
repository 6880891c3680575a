"""A log as a page of plots: pointing errors, torques and the law's own signals."""

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FixedLocator, MaxNLocator

from mjspace.errors import whole_or_none
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.plotting.check_bounds import Bound, bounds
from mjspace.plotting.panels import Curves, chosen, curves
from mjspace.plotting.style import COLORS, FAINT, INK, STYLE
from mjspace.scenario.scenario import Scenario

# Inches: the page's width and edges, a panel and the space around it, head and foot.
COASTS = "coast:Coast"
"""The law that commands nothing."""
TIMES = (
    ("days", 86400.0, 4 * 86400.0),
    ("h", 3600.0, 3 * 3600.0),
    ("min", 60.0, 600.0),
    ("s", 1.0, 0.0),
)
"""Units of time in seconds, and the span from which on each is used."""
FORMATS = (".png", ".pdf", ".svg")
WIDTH, LEFT, RIGHT, PANEL, BETWEEN, HEAD, FOOT = 12.5, 0.7, 0.25, 1.75, 0.5, 1.05, 0.85


def plot(log: Log | Path | str, output: Path | str, *, signals: Sequence[str] = ()) -> None:
    """Write a log's page of plots: the standard one, or one panel for each of ``signals``.

    Signals are named as in a scenario's checks (``truth.rate[0]``); values are in the log's SI
    units with a prefix, angles in degrees and wheel speeds in rpm. The log is never loaded whole: a
    line has at most some 4000 points, the extremes among them.

    Raises:
        ValueError: ``output`` does not end in .png, .pdf or .svg, no such signal, or not a log of
            mjspace.
        OSError: a file cannot be read or written.
    """
    output = Path(output)
    if output.suffix not in FORMATS:
        raise ValueError(f"output {str(output)!r}: end it in {', '.join(FORMATS)}")
    with matplotlib.rc_context(STYLE):
        page = figure(log, signals)
        with whole_or_none(output) as file:
            page.savefig(file, dpi=110, facecolor="white", format=output.suffix[1:])


def figure(log: Log | Path | str, signals: Sequence[str] = ()) -> Figure:
    """Return the page as a matplotlib figure, as ``plot`` writes it but for the style.

    Raises:
        ValueError: no such signal, or not a log of mjspace.
        OSError: the log cannot be read.
    """
    log = Log.of(log)
    scenario = scenario_of(log)
    coasting = scenario.law.kind == COASTS
    found = chosen(log, signals) if signals else curves(log, coasting=coasting)
    warnings = [e.time for e in log.events() if e.level in ("WARNING", "ERROR", "FATAL")]
    rows = max(1, (len(found) + 1) // 2)
    height = HEAD + rows * (PANEL + BETWEEN) - BETWEEN + FOOT
    page = Figure(figsize=(WIDTH, height))
    FigureCanvasAgg(page)
    grid = page.subplots(rows, 2, squeeze=False, sharex=True)
    page.subplots_adjust(
        left=LEFT / WIDTH,
        right=1.0 - RIGHT / WIDTH,
        bottom=FOOT / height,
        top=1.0 - HEAD / height,
        hspace=BETWEEN / PANEL,
        wspace=0.14,
    )
    for axes, one in zip(grid.flat, found, strict=False):
        colors = line_colors(one)
        draw(axes, one, colors)
        for bound in bounds(one.panel, scenario.checks, log):
            axes.margins(y=0.16)  # room for the bound's text
            _mark(axes, bound, colors[bound.component if one.panel.part is None else 0])
        # Saturation, an early end, a check that failed: along the top, where no ticks are.
        axes.plot(
            warnings,
            np.ones(len(warnings)),
            "|",
            color=COLORS[3],
            markersize=7,
            transform=axes.get_xaxis_transform(),
            clip_on=False,
        )
    unit = scale_time(grid.flat[0], log)
    for axes in grid.flat[len(found) :]:
        axes.set_axis_off()
    for axes in grid.flat[max(len(found) - 2, 0) : len(found)]:
        axes.tick_params(labelbottom=True)
        axes.set_xlabel(f"time [{unit}]")
    _caption(page, scenario, log, height)
    return page


def scale_time(axes: Any, log: Log) -> str:
    """Set the limits and the ticks of an axis of time, and return its unit."""
    span = log.end - log.start
    unit, seconds = next(each for each in TIMES if span >= each[2])[:2]
    if span > 0.0:
        axes.set_xlim(log.start, log.end)
        round_numbers = MaxNLocator(8, steps=[1, 2, 2.5, 3, 5, 6, 10])
        ticks = round_numbers.tick_values(log.start / seconds, log.end / seconds)
        axes.xaxis.set_major_locator(FixedLocator([seconds * tick for tick in ticks]))
        axes.xaxis.set_major_formatter(lambda value, _: _short(value / seconds))
    return str(unit)


def line_colors(one: Curves) -> list[str]:
    """Return a color for each line of a panel."""
    count = one.value.shape[1]
    return [INK] if count == 1 else [COLORS[i % len(COLORS)] for i in range(count)]


def draw(axes: Any, one: Curves, colors: Sequence[str]) -> None:
    """Draw a panel: its lines, those desired of them, its title and the legend."""
    panel, count = one.panel, len(colors)
    if panel.lanes:
        _draw_lanes(axes, one)
        return
    for i, (name, color) in enumerate(zip(panel.names or range(count), colors, strict=True)):
        axes.plot(one.time[:, i], one.value[:, i], color=color, label=str(name))
        if one.desired is not None and one.desired_time is not None:
            axes.plot(
                one.desired_time[:, i],
                one.desired[:, i],
                color=color,
                linewidth=2.6,
                alpha=0.3,
                zorder=1,
                label="desired" if i == count - 1 else None,
            )
    unit = f" [{panel.unit}]" if panel.unit else ""
    axes.set_title(panel.title + unit, loc="left", fontweight="bold", fontsize=9.5)
    if panel.log_scale:
        axes.set_yscale("log")
    else:
        axes.yaxis.set_major_formatter(lambda value, _: _short(value))
    if count > 1:
        axes.legend(
            loc="lower right",
            bbox_to_anchor=(1.0, 0.98),
            ncols=count + 1,
            frameon=False,
            handlelength=1.0,
            columnspacing=0.9,
            handletextpad=0.4,
            borderpad=0.1,
            fontsize=8,
        )


def _draw_lanes(axes: Any, one: Curves) -> None:
    """Draw each component in a lane: its part of the largest value of all."""
    count, largest = one.value.shape[1], float(np.max(np.abs(one.value))) or 1.0
    for i in range(count):
        height = 0.8 * one.value[:, i] / largest
        axes.fill_between(one.time[:, i], i, i + height, step="post", color=INK, lw=0.0)
    axes.set_ylim(-0.2, count)
    axes.set_yticks(range(0, count, max(1, count // 6)))
    axes.set_title(one.panel.title, loc="left", fontweight="bold", fontsize=9.5)


def _short(value: float) -> str:
    """Return a tick's label, for which there is room for some 8 characters."""
    text = f"{value:.6g}"
    if value and not 0.999e-3 < abs(value) < 1e6:
        mantissa, _, exponent = f"{value:.3e}".partition("e")
        text = f"{mantissa.rstrip('0').rstrip('.')}e{int(exponent)}"
    return text.replace("-", "\N{MINUS SIGN}")


def _mark(axes: Any, bound: Bound, color: str) -> None:
    dashes = (0, (4, 2))
    axes.plot([bound.start, bound.end], [bound.value] * 2, color=color, lw=1.0, ls=dashes)
    axes.annotate(
        bound.text,
        (bound.end, bound.value),
        (0, 2 if bound.upper else -2),
        textcoords="offset points",
        ha="right",
        va="bottom" if bound.upper else "top",
        fontsize=7,
        color=color,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],
    )


def _caption(page: Figure, scenario: Scenario, log: Log, height: float) -> None:
    left = 0.15 / WIDTH
    page.text(left, 1.0 - 0.15 / height, scenario.name, va="top", fontsize=14, fontweight="bold")
    description = textwrap.shorten(scenario.description, 160, placeholder=" ...")
    page.text(left, 1.0 - 0.47 / height, description, va="top", color="#5b6470")
    version = log.metadata.get("mjspace", "")
    parts = [f"law {scenario.law.kind}", f"{log.path.name}", f"mjspace {version}"]
    if not log.complete:
        parts.append("the log was cut short")
    page.text(left, 0.14 / height, "  |  ".join(parts), va="bottom", fontsize=7.5, color=FAINT)
