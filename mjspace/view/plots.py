"""Plots beside the scene, whose cursor is at the time that is shown."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.errors import printable
from mjspace.plotting.panels import Curves

COLORS = ("#f2554a", "#4dd94d", "#5a8cff", "#e0b030", "#c060e0", "#30c8c8", "#e080a0", "#a0a0a0")
POINTS = 300
"""Of a line: as many as a plot has pixels across."""
WIDTH, HEIGHT = 420, 190  # pixels
_MOST_LINES = 8


class Plot:
    """One chart: its lines, and the part up to the time that is shown shaded."""

    def __init__(self, gui: Any, curves: Curves) -> None:
        """Add the chart of ``curves`` to viser's ``gui``."""
        panel = curves.panel
        self._time, self._values = _on_one_axis(curves)
        finite = self._values[np.isfinite(self._values)]
        low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
        rim = 0.06 * (high - low) or 0.06 * abs(high) or 1.0
        self._low, self._high = low - rim, high + rim
        names = [
            panel.names[i] if i < len(panel.names) else str(i) for i in range(len(self._values))
        ]
        unit = f" [{panel.unit}]" if panel.unit else ""
        log = "log10 of " if panel.log_scale else ""
        lines = [
            {"label": printable(name), "stroke": color, "width": 1.4, "points": {"show": False}}
            for name, color in zip(names, COLORS, strict=False)
        ]
        done = {
            "label": "shown",
            "stroke": "#e8e8e8",
            "width": 1.2,
            "fill": "rgba(128, 160, 255, 0.13)",
            "fillTo": self._low,
            "points": {"show": False},
        }
        self._handle = gui.add_uplot(
            self._data(float(self._time[0])),
            ({"label": "t [s]"}, done, *lines),
            title=printable(f"{log}{panel.title}{unit}"),
            scales={"x": {"time": False}, "y": {"range": (self._low, self._high)}},
            legend={"show": False},
            height=HEIGHT,
        )

    def show(self, time: float) -> None:
        """Move the cursor to ``time`` [s]."""
        self._handle.data = self._data(time)

    def _data(self, time: float) -> tuple[Array, ...]:
        # At the cursor the time stands twice: there the shading drops from top to bottom.
        at = int(np.searchsorted(self._time, time))
        both = np.full(2, np.clip(time, self._time[0], self._time[-1]))
        shading = np.full(len(self._time) + 2, self._low)
        shading[: at + 1] = self._high
        here = [np.interp(time, self._time, row) for row in self._values]
        lines = [
            np.insert(row, at, [value, value])
            for row, value in zip(self._values, here, strict=True)
        ]
        return np.insert(self._time, at, both), shading, *lines


def add(gui: Any, curves: Sequence[Curves]) -> list[Plot]:
    """Add a panel of charts on the right, and return them."""
    panel = gui.add_panel()
    with panel.add_tab("Plots"):
        plots = [Plot(gui, one) for one in curves]
    panel.dock_right()
    panel.set_width(WIDTH)
    return plots


def _on_one_axis(curves: Curves) -> tuple[Array, Array]:
    """Return times (n,) and values (c, n) of the curves' first components, in few points."""
    start, end = float(np.nanmin(curves.time)), float(np.nanmax(curves.time))
    count = curves.value.shape[1]
    time = np.unique(curves.time)  # each component has those of its own extremes
    time = time if len(time) > 1 else np.array([start, max(end, start + 1e-9)])
    rows = [
        np.interp(time, curves.time[:, i], curves.value[:, i])
        for i in range(min(count, _MOST_LINES))
    ]
    values = np.array(rows)
    if curves.panel.log_scale:
        with np.errstate(divide="ignore", invalid="ignore"):
            values = np.log10(np.where(values > 0.0, values, np.nan))
        least = np.nanmin(values) if np.isfinite(values).any() else 0.0
        values = np.where(np.isfinite(values), values, least)
    return time, values
