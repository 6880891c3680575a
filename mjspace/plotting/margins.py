"""Margins in one picture: each flight that was flown, well or badly, on a logarithmic axis."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mjspace.errors import whole_or_none
from mjspace.plotting.style import COLORS, INK, STYLE


class Row(NamedTuple):
    """The flights of one perturbation."""

    title: str
    unit: str
    """"" for a factor."""
    values: Sequence[float]
    survived: Sequence[bool]


def plot(rows: Sequence[Row], title: str, output: Path) -> None:
    """Write a PNG with a line for each of the ``rows``.

    Raises:
        ValueError: ``output`` does not end in .png.
        OSError: the file cannot be written.
    """
    if output.suffix != ".png":
        raise ValueError(f"output {str(output)!r}: end it in .png")
    with matplotlib.rc_context(STYLE):
        page = Figure(figsize=(9.0, 0.6 + 0.75 * len(rows)))
        FigureCanvasAgg(page)
        page.suptitle(title, x=0.01, ha="left", fontweight="bold", fontsize=10)
        grid = page.subplots(len(rows), 1, squeeze=False)
        for axes, row in zip(grid.flat, rows, strict=True):
            _draw(axes, row)
        height = page.get_figheight()
        page.subplots_adjust(
            left=0.3, right=0.97, top=1.0 - 0.5 / height, bottom=0.3 / height, hspace=1.6
        )
        with whole_or_none(output) as file:
            page.savefig(file, dpi=110, facecolor="white")


def _draw(axes: Any, row: Row) -> None:
    values, well = np.array(row.values), np.array(row.survived, dtype=bool)
    for chosen, color, marker in ((well, COLORS[1], "o"), (~well, COLORS[0], "x")):
        zero = np.zeros(int(chosen.sum()))
        axes.plot(values[chosen], zero, marker, color=color, markersize=5, clip_on=False)
    axes.set_xscale("log")
    axes.set_xlim(values.min() / 1.3, values.max() * 1.3)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")
    unit = f" [{row.unit}]" if row.unit else ""
    axes.set_ylabel(row.title + unit, rotation=0, ha="right", va="center", color=INK)
