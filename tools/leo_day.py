"""Writes docs/leo_day.png: a day of the scenario leo-day, its errors, wheels and ground track.

Usage: python tools/leo_day.py [LOG]

Without a LOG the day is flown, for a minute or two. The shadow is shaded.
"""

import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from mjspace.contract import Array
from mjspace.log.reader import Log
from mjspace.plotting.style import COLORS, STYLE
from mjspace.runner.run import run

PICTURE = Path(__file__).parents[1] / "docs/leo_day.png"
ORBITS_SHOWN = 6.0
"""h, of the panels of errors: a day's are too many to be told apart."""
LIMIT = 0.12
"""Largest error shown [deg]."""
RPM = 60.0 / (2.0 * np.pi)


def draw(truth: Mapping[str, Array], estimate: Mapping[str, Array], path: Path) -> None:
    """Draw estimation error, pointing error, wheel speeds and where the satellite was."""
    with matplotlib.rc_context(STYLE):
        page = Figure(figsize=(9.0, 9.0), layout="constrained")
        rows = page.subplots(4, 1, height_ratios=[1, 1, 1, 1.6])
        hours = truth["time"] / 3600.0
        error, bound = np.degrees(truth["estimation_error"]), np.degrees(estimate["attitude_bound"])
        for axis in range(3):
            rows[0].plot(hours, error[:, axis], color=COLORS[axis], lw=0.8, label="xyz"[axis])
        for side in (-1.0, 1.0):
            rows[0].plot(hours, side * bound.max(axis=1), color="0.55", lw=0.8)
        rows[0].set(xlim=(0.0, ORBITS_SHOWN), ylim=(-LIMIT, LIMIT), ylabel="estimation error [deg]")
        blind = truth["attitude_valid"][:, 0] < 0.5
        rows[0].fill_between(
            hours, -LIMIT, -0.92 * LIMIT, where=blind, color="k", lw=0, label="tracker blinded"
        )
        rows[0].legend(ncols=4, loc="upper right", fontsize="small")
        pointing = np.degrees(truth["camera_nadir_angle"][:, 0])
        rows[1].plot(hours, pointing, color=COLORS[0], lw=0.8)
        rows[1].set(xlim=(0.0, ORBITS_SHOWN), ylim=(0.0, 0.1), ylabel="camera off nadir [deg]")
        rows[1].set_xlabel("time [h]")
        for wheel in range(3):
            speed = RPM * truth["wheel_speed"][:, wheel]
            rows[2].plot(hours, speed, color=COLORS[wheel], lw=0.8, label=f"wheel {wheel}")
        rows[2].set(
            xlim=(0.0, 24.0), ylim=(-60.0, 380.0), ylabel="wheel speed [rpm]", xlabel="time [h]"
        )
        rows[2].legend(ncols=3, loc="upper right", fontsize="small")
        dark = truth["sunlight"][:, 0] < 0.5
        for panel in rows[:3]:
            low, high = panel.get_ylim()
            panel.fill_between(hours, low, high, where=dark, color="0.9", lw=0, zorder=0)
            panel.set_ylim(low, high)
        map_(rows[3], truth, dark)
        page.savefig(path, dpi=150)


def map_(panel: Any, truth: Mapping[str, Array], dark: Array) -> None:
    """Draw the ground track, in sunlight and in the shadow."""
    longitude, latitude = (np.degrees(truth[n][:, 0]) for n in ("longitude", "latitude"))
    for shown, color, label in ((~dark, COLORS[1], "in sunlight"), (dark, "0.25", "in the shadow")):
        panel.scatter(longitude[shown], latitude[shown], s=1.5, color=color, label=label)
    panel.plot(longitude[0], latitude[0], "^", color="k", ms=6, label="start")
    panel.plot(longitude[-1], latitude[-1], "s", color="k", ms=5, label="after a day")
    panel.set(xlim=(-180, 180), ylim=(-90, 90), xlabel="longitude [deg]", ylabel="latitude [deg]")
    panel.set_xticks(range(-180, 181, 60), minor=False)
    panel.set_yticks(range(-90, 91, 30), minor=False)
    panel.grid(visible=True, lw=0.4)
    panel.legend(ncols=4, loc="lower center", fontsize="small", markerscale=1.5)


def main() -> None:
    """Draw the given log, or that of a flight."""
    with tempfile.TemporaryDirectory() as folder:
        log = Log(sys.argv[1] if sys.argv[1:] else run("leo-day", out=folder).path)
        draw(log.read("/truth"), log.read("/estimate"), PICTURE)


if __name__ == "__main__":
    main()
