"""The papers' figures drawn again, from the logs of flights."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from paper_claims import Curve, Panel, Picture
from PIL import Image

from mjspace.contract import Array
from mjspace.log.reader import Log
from mjspace.plotting.panels import unit
from mjspace.plotting.style import COLORS, FAINT, INK, STYLE
from mjspace.signals import find_signal, magnitude

NAMED = {"red": COLORS[0], "black": INK, "blue": COLORS[2]}
WIDTH, ROW, DPI = 9.0, 2.5, 110
INKS = 255
"""Colors in a file, which has a palette: a third of the size."""
POINTS = 3000
"""At most so many are drawn of a curve that is not a path."""


def draw(picture: Picture, logs: Mapping[str, Log], folder: Path) -> None:
    """Write the picture as PNG into the folder, from the flights' ``logs``."""
    rows = (len(picture.panels) + 1) // 2
    with matplotlib.rc_context(STYLE):
        page = Figure(figsize=(WIDTH, ROW * rows), dpi=DPI, layout="constrained")
        canvas = FigureCanvasAgg(page)
        for axes, panel in zip(page.subplots(rows, 2).flat, picture.panels, strict=True):
            _draw(axes, panel, logs)
        canvas.draw()
        image = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    inks = image.quantize(INKS, dither=Image.Dither.NONE)
    inks.save(folder / picture.file, optimize=True)


def _draw(axes: Any, panel: Panel, logs: Mapping[str, Log]) -> None:
    for level in panel.levels:
        axes.axhline(level, color=FAINT, lw=0.8, ls=(0, (4, 2)))
    for curve in panel.curves:
        across, up = _points(curve, panel, logs[curve.flight])
        width = {"lw": 3.0, "alpha": 0.3, "zorder": 1} if curve.faint else {"lw": 1.1}
        colors = COLORS
        if curve.color:
            colors = (NAMED[curve.color],)
        elif up.shape[1] == 1:
            colors = (INK,) if len(panel.curves) == 1 else (COLORS[panel.curves.index(curve)],)
        for i, values in enumerate(up.T):
            color = colors[i % len(colors)]
            label = curve.labels[i] if curve.labels else None
            axes.plot(across, values, color=color, label=label, **width)
    axes.set_title(panel.title, loc="left", fontweight="bold", fontsize=9)
    if panel.log:
        axes.set_yscale("log")
    drawn = panel.curves[0]
    if drawn.x:
        axes.axhline(0.0, color=FAINT, lw=0.7, zorder=0)
        axes.set_xlabel(_label(drawn.x, logs[drawn.flight]), fontsize=8)
        axes.set_ylabel(_label(drawn.y, logs[drawn.flight]), fontsize=8)
    else:
        end = panel.end or max(logs[curve.flight].end for curve in panel.curves)
        axes.set_xlim(panel.start, end)
        axes.xaxis.set_major_locator(MaxNLocator(6))
        axes.set_xlabel("time [s]", fontsize=8)
    if any(curve.labels for curve in panel.curves):
        where = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.0}
        axes.legend(frameon=False, fontsize=7.5, handlelength=1.0, **where)


def _label(signal: str, log: Log) -> str:
    topic, field, _ = find_signal(log.topics, signal)
    return f"{signal} [{unit(log, topic, field).displayed[0]}]"


def _points(curve: Curve, panel: Panel, log: Log) -> tuple[Array, Array]:
    """Return what the curve is drawn from, (n,), and its values, (n, c)."""
    time, values = _read(curve.y, curve.si, log)
    if curve.x:
        return _read(curve.x, curve.si, log)[1][:, 0], values
    if panel.running:
        squares = magnitude(values) ** 2
        values = np.sqrt(np.cumsum(squares) * log.control_period)[:, None]
    inside = (time >= panel.start) & (time <= (panel.end or np.inf))
    every = max(1, int(inside.sum()) // POINTS)
    return time[inside][::every], values[inside][::every]


def _read(signal: str, si: bool, log: Log) -> tuple[Array, Array]:
    """Return a signal's times (n,) and values (n, c), in the unit of plots or in SI."""
    topic, field, part = find_signal(log.topics, signal)
    rows = log.read(topic, [field])
    values = rows[field].reshape(len(rows["time"]), -1)[:, part]
    return rows["time"], values * (1.0 if si else unit(log, topic, field).displayed[1])
