"""Two logs in one picture: signals of both, one over the other."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mjspace.errors import whole_or_none
from mjspace.log.reader import Log
from mjspace.plotting.panels import chosen
from mjspace.plotting.style import COLORS, INK, STYLE

MOST = 8
"""Signals in a picture."""


def plot(first: Log, second: Log, output: Path, signals: Sequence[str]) -> None:
    """Write a PNG with a panel for each of the first ``signals``, of both logs.

    The second log is dashed. Signals are named as in a check.

    Raises:
        ValueError: ``output`` does not end in .png, or a log has no such signal.
        OSError: a file cannot be read or written.
    """
    if output.suffix != ".png":
        raise ValueError(f"output {str(output)!r}: end it in .png")
    shown = signals[:MOST]
    rows = max(1, (len(shown) + 1) // 2)
    with matplotlib.rc_context(STYLE):
        page = Figure(figsize=(12.5, 1.0 + 2.2 * rows), layout="constrained")
        FigureCanvasAgg(page)
        grid = page.subplots(rows, 2, squeeze=False, sharex=True)
        page.suptitle(f"{first.path} and, dashed, {second.path}", x=0.01, ha="left", fontsize=9)
        drawn = zip(grid.flat, chosen(first, shown), chosen(second, shown), strict=False)
        for axes, one, two in drawn:
            count = one.value.shape[1]
            for i in range(count):
                color = INK if count == 1 else COLORS[i % len(COLORS)]
                axes.plot(one.time[:, i], one.value[:, i], color=color, alpha=0.55)
                axes.plot(two.time[:, i], two.value[:, i], color=color, ls=(0, (4, 2)))
            unit = f" [{one.panel.unit}]" if one.panel.unit else ""
            axes.set_title(one.panel.title + unit, loc="left", fontweight="bold", fontsize=9.5)
        for axes in grid.flat[len(shown) :]:
            axes.set_axis_off()
        for axes in grid[-1]:
            axes.set_xlabel("time [s]")
        with whole_or_none(output) as file:
            page.savefig(file, dpi=110, facecolor="white")
