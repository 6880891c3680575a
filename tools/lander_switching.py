"""Write the table of switching terms in docs/lander.md, from flights of ``lander-switching``.

Usage: python tools/lander_switching.py

It takes half a minute. The first and the last row have no scenario of their own.
"""

import tempfile
from pathlib import Path

import numpy as np

from mjspace.contract import Array
from mjspace.log.reader import Log
from mjspace.runner.run import run

PAGE = Path(__file__).parents[1] / "docs/lander.md"
BEGIN, END = "<!-- switching: tools/lander_switching.py -->\n\n", "\n<!-- end of switching -->"
TITLES = (
    *("psi", "mean S, gimbal [rad]", "RMS gimbal rate [rad/s]", "(35) [rad]"),
    "off the path after 60 s [m]",
)
HEAD = f"| {' | '.join(TITLES)} |\n|{'---|' * len(TITLES)}\n"
TANH = "law.switching=tanh"
FLIGHTS = {
    "tanh, delta = 50 as printed, no disturbance": [TANH, "environment.torques=[]"],
    "tanh, delta = 50 as printed": [TANH],
    "tanh, delta = 0.005 (`lander-smoothed`)": [TANH, "law.smoothing=0.005"],
    "tanh, delta = 0.0005": [TANH, "law.smoothing=0.0005"],
    "sgn (`lander-switching`)": [],
    "sgn at 250 Hz": ["rates.control=0.004"],
}


def late(log: Log, topic: str, field: str) -> Array:
    """Return the field's rows from 20 s on."""
    rows = log.read(topic, [field])[field]
    return rows[len(rows) // 3 :]


def row(name: str, overrides: list[str], out: Path) -> str:
    """Fly once; return the row of the table."""
    run("lander-switching", overrides=["checks=[]", "events=[]", *overrides], out=out)
    log = Log(out / "flight.mcap")
    rate = late(log, "/truth", "gimbal_rate")
    cells = (
        np.mean(late(log, "/law", "S")[:, 1]),
        np.sqrt(np.mean(np.sum(rate**2, axis=1))),
        np.mean(late(log, "/law", "required_gain")[:, 1]),
        np.linalg.norm(late(log, "/law", "position_error")[-1]),
    )
    return f"| {name} | {' | '.join(f'{cell:.3g}' for cell in cells)} |\n"


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            row(name, overrides, Path(folder) / str(number))
            for number, (name, overrides) in enumerate(FLIGHTS.items())
        ]
    text = PAGE.read_text()
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    PAGE.write_text(before + BEGIN + HEAD + "".join(rows) + END + after)
