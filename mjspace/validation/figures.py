"""A benchmark's figure: the motion, and the error of each integrator over time."""

import io
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from mjspace.plotting.style import COLORS, FAINT, STYLE
from mjspace.validation.benchmark import Integrator
from mjspace.validation.results import Line, Section

# The first-order integrators often coincide: dashes keep all of them visible.
_INTEGRATORS: dict[Integrator, tuple[str, str]] = {
    "RK4": ("#2f6fd0", "-"),
    "Euler": ("#d1453b", "-"),
    "implicit": ("#e08a1e", "--"),
    "implicitfast": ("#8a4fbf", ":"),
}
# The same figure gives the same bytes: no random identifiers, no date.
_STYLE = STYLE | {"svg.hashsalt": "mjspace", "svg.fonttype": "none", "svg.id": "figure"}


def svg(section: Section) -> str:
    """Return the section's figure as an SVG element."""
    with matplotlib.rc_context(_STYLE):
        page = Figure(figsize=(10.0, 3.0))
        FigureCanvasSVG(page)
        # A fixed layout takes a tenth of the time of an automatic one.
        room = {"left": 0.075, "right": 0.98, "bottom": 0.16, "top": 0.97, "wspace": 0.22}
        motion, error = page.subplots(1, 2, width_ratios=[1.25, 1.0], gridspec_kw=room)
        _draw_motion(motion, section)
        _draw_errors(error, section)
        buffer = io.StringIO()
        page.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :]


def _draw_motion(axes: Any, section: Section) -> None:
    # The exact line and its dots have one color, in any order of the lines.
    colors: dict[str, str] = {}
    for line in section.motion:
        name = line.label.removesuffix(", MuJoCo")
        color = colors.setdefault(name, COLORS[len(colors) % len(COLORS)])
        if line.dots:
            every = max(1, len(line.x) // 40) if line.label != name else 1
            axes.plot(line.x[::every], line.y[::every], ".", color=color, ms=4.5, label=_key(line))
        else:
            axes.plot(line.x, line.y, color=color, label=_key(line))
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:.6g}")
    axes.set_xlabel(section.x_label)
    axes.set_ylabel(section.y_label)
    axes.legend(fontsize=7, frameon=False, ncols=2, loc="best", handlelength=1.2)


def _key(line: Line) -> str | None:
    """Return the line's legend; dots beside an exact line of the same name have none."""
    return None if line.label.endswith(", MuJoCo") else line.label


def _draw_errors(axes: Any, section: Section) -> None:
    for integrator, line in section.errors.items():
        y = np.abs(np.array(line.y, dtype=float))
        y[y == 0.0] = np.nan  # not drawn: the axis is logarithmic
        color, dashes = _INTEGRATORS[integrator]
        axes.plot(line.x, y, color=color, linestyle=dashes, label=integrator)
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:.0e}")
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("time [s]")
    axes.set_ylabel(section.error_label)
    axes.grid(color=FAINT, alpha=0.25)
    if len(section.errors) > 1:
        axes.legend(fontsize=7, frameon=False, ncols=2, loc="best", handlelength=1.2)
