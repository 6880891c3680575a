"""Writes docs/imaging_pass.png: the flight of the scenario imaging-target.

Usage: python tools/imaging_pass.py
"""

import tempfile
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from mjspace.plotting.style import COLORS, FAINT, STYLE
from mjspace.runner.run import run

PICTURE = Path(__file__).parents[1] / "docs/imaging_pass.png"
ANGLES = {"sun": "off the Sun", "nadir": "off nadir", "limb": "off the planet's limb"}


def draw(path: Path) -> None:
    """Fly the scenario and draw where its camera looks, how it turns, and how far it is off."""
    with tempfile.TemporaryDirectory() as folder:
        log = run("imaging-target", out=Path(folder)).log
        truth, desired = log.read("/truth"), log.read("/reference")
    time = truth["time"]
    with matplotlib.rc_context(STYLE):
        page = Figure(figsize=(7.5, 7.0), layout="constrained")
        looks, turns, speeds_up, errs = page.subplots(4, 1, sharex=True, height_ratios=(3, 2, 2, 2))
        for (angle, label), color in zip(ANGLES.items(), COLORS, strict=False):
            looks.plot(time, np.degrees(truth[f"camera_{angle}_angle"]), color=color, label=label)
        looks.axhline(90.0, color=COLORS[0], linestyle=":", label="keep-out: 90 deg off the Sun")
        looks.set_ylabel("camera [deg]")
        looks.legend(frameon=False, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
        for panel, field, limit in ((turns, "rate", 0.8), (speeds_up, "acceleration", 0.02)):
            for axis, color in enumerate(COLORS[:3]):
                curve = np.degrees(desired[field][:, axis])
                panel.plot(time, curve, color=color, label="xyz"[axis])
            for sign in (-1.0, 1.0):
                panel.axhline(sign * limit, color=FAINT, linestyle=":")
        turns.set_ylabel("rate [deg/s]")
        turns.legend(frameon=False, ncols=3)
        speeds_up.set_ylabel("acceleration [deg/s$^2$]")
        errs.plot(time, np.degrees(truth["attitude_error"]) * 3600.0, color=COLORS[4])
        errs.set_ylabel("attitude error [arcsec]")
        errs.set_xlabel("time [s]")
        page.savefig(path, dpi=150)


if __name__ == "__main__":
    draw(PICTURE)
