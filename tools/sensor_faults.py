"""Writes docs/sensor_faults.png: a slew with a blinded star tracker and a stuck gyro, two laws.

Usage: python tools/sensor_faults.py
"""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from mjspace.contract import Array
from mjspace.plotting.style import COLORS, FAINT, STYLE
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly

PICTURE = Path(__file__).parents[1] / "docs/sensor_faults.png"
NAMES = {"sensor-faults": "flag and median", "sensor-faults-unguarded": "all believed"}
SIGNALS = ("/truth.attitude_error", "/truth.rate", "/measurement.tracker_valid")


def flight(name: str) -> dict[str, Array]:
    """Return the first 25 s: "time" (n,) and signals (n, k)."""
    built = assemble(*load(name, ["duration=25", "checks=[]"]))
    blocks = list(fly(built, first_start(built, [0])))
    found = {"time": np.concatenate([block.time for block in blocks])}
    for signal in (*SIGNALS, "/measurement.gyro_1"):
        topic, field = signal.split(".")
        found[signal] = np.concatenate([block.rows[topic][field][:, 0] for block in blocks])
    return found


def draw(flights: dict[str, dict[str, Array]]) -> Figure:
    """Return the figure: attitude error, and the second component of rate and stuck gyro."""
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    error, rate = figure.subplots(2, 1, sharex=True)
    for color, (name, rows) in zip((COLORS[1], COLORS[0]), flights.items(), strict=True):
        time = rows["time"]
        blind = np.where(rows["/measurement.tracker_valid"][:, 0] < 0.5, 1.0, np.nan)
        error.plot(time, np.degrees(rows["/truth.attitude_error"]), color=color, label=NAMES[name])
        error.plot(time, (-6.0 - 5.0 * (color == COLORS[0])) * blind, color=color, lw=3)
        rate.plot(time, np.degrees(rows["/truth.rate"][:, 1]), color=color, label=NAMES[name])
    guarded = flights["sensor-faults"]
    gyro = np.degrees(guarded["/measurement.gyro_1"][:, 1])
    rate.plot(guarded["time"], gyro, color=FAINT, ls="--", label="gyro that sticks at 12 s")
    error.set_ylabel("attitude error [deg]\n(bars: tracker blinded)")
    rate.set_ylabel("rate about y [deg/s]")
    rate.set_xlabel("time [s]")
    error.legend(frameon=False, loc="upper center")
    rate.legend(frameon=False, loc="upper left")
    return figure


if __name__ == "__main__":
    with matplotlib.rc_context(STYLE):
        draw({name: flight(name) for name in NAMES}).savefig(PICTURE, dpi=150)
