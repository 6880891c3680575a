"""Writes docs/determination.png: the errors of the two determination scenarios, and their bounds.

Usage: python tools/estimation_errors.py

Each error is drawn about each body axis, with three standard deviations of the filter's covariance
to both sides; the shadow is shaded.
"""

import tempfile
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from mjspace.log.reader import Log
from mjspace.plotting.style import COLORS, STYLE
from mjspace.runner.run import run

PICTURE = Path(__file__).parents[1] / "docs/determination.png"
FLIGHTS = {
    "estimated-attitude": ("star tracker and gyro, in a slew", "s", 1.0, 0.03),
    "sun-magnetometer": ("Sun sensor, magnetometer and gyro", "min", 60.0, 0.3),
}
"""Of each scenario: title, unit of time, its seconds, and the largest error shown [deg]."""


def draw(path: Path) -> None:
    """Draw a column for each flight, a row for each body axis."""
    with matplotlib.rc_context(STYLE):
        page = Figure(figsize=(9.0, 5.4), layout="constrained")
        panels = page.subplots(3, len(FLIGHTS), sharex="col")
        for column, (name, (title, unit, seconds, limit)) in enumerate(FLIGHTS.items()):
            truth, bound = flown(name)
            panels[0, column].set_title(f"{name}: {title}", fontsize="medium")
            for axis in range(3):
                panel = panels[axis, column]
                time = truth["time"] / seconds
                for side in (-1.0, 1.0):
                    panel.plot(time, side * np.degrees(bound[:, axis]), color="0.55", lw=0.8)
                error = np.degrees(truth["estimation_error"][:, axis])
                panel.plot(time, error, color=COLORS[axis], lw=0.7)
                if "sunlight" in truth:
                    dark = truth["sunlight"][:, 0] < 0.5
                    panel.fill_between(time, -limit, limit, where=dark, color="0.9", lw=0)
                panel.set_ylim(-limit, limit)
                panel.set_ylabel(f"about {'xyz'[axis]} [deg]")
            panels[2, column].set_xlabel(f"time [{unit}]")
        page.savefig(path, dpi=150)


def flown(name: str) -> tuple[dict[str, Any], Any]:
    """Return the truth and the bounds [rad] of that scenario's flight."""
    with tempfile.TemporaryDirectory() as folder:
        log = Log(run(name, out=folder).path)
        return log.read("/truth"), log.read("/estimate")["attitude_bound"]


if __name__ == "__main__":
    draw(PICTURE)
