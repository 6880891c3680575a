"""Write the table of actuators in docs/lander_descent.md, from the start of ``lander``.

Usage: python tools/lander_actuation.py

It takes a minute. Two of the rows have no scenario of their own.
"""

import tempfile
from pathlib import Path

import numpy as np

from mjspace.log.reader import Log
from mjspace.runner.run import run

PAGE = Path(__file__).parents[1] / "docs/lander_descent.md"
BEGIN, END = "<!-- actuation: tools/lander_actuation.py -->\n\n", "\n<!-- end of actuation -->"
TITLES = (
    *(
        "actuators and law",
        "propellant, engine and thrusters [kg]",
        "error from 100 s on [m]",
    ),
    *("down, aside at touchdown [m/s]", "tilt there [deg]", "from the site [m]"),
)
HEAD = f"| {' | '.join(TITLES)} |\n|{'---|' * len(TITLES)}\n"
PERIOD = 0.02
"""Of a control period of all of them [s]."""
VECTORING = "law={kind='lander_vectoring:ThrustVectoring', tank=20}"
DEAD = "faults=[{motor='thruster_thrust', kind='dead', at=40}]"
FLIGHTS = {
    "gimballed engine, variable structure (`lander`)": ("lander", []),
    "gimballed engine, thrust vectoring": ("lander", [VECTORING]),
    "engine and 28 thrusters, PID (`lander-over-actuated`)": ("lander-over-actuated", []),
    "the same, its thrusters dead from 40 s on": ("lander-over-actuated", [DEAD]),
}


def row(name: str, scenario: str, overrides: list[str], out: Path) -> str:
    """Fly once; return the row of the table."""
    run(scenario, overrides=["checks=[]", *overrides], out=out)
    log = Log(out / "flight.mcap")
    names = ["position", "position_error", "touchdown_velocity", "tilt", "propellant", "contact"]
    truth = log.read("/truth", names)
    touches = truth["contact"][:, 0] > 0.0
    at = int(np.argmax(touches)) if touches.any() else -1
    late = slice(int(100.0 / PERIOD), at)
    burnt = truth["propellant"][0] - truth["propellant"][at]
    velocity = truth["touchdown_velocity"][at]
    cells = (
        " + ".join(f"{kg:.2f}" for kg in burnt),
        f"{np.linalg.norm(truth['position_error'][late], axis=1).max():.3g}",
        f"{-velocity[2]:.3g}, {np.hypot(*velocity[:2]):.2g}",
        f"{np.degrees(truth['tilt'][at, 0]):.2g}",
        f"{np.hypot(*truth['position'][at, :2]):.2g}",
    )
    return f"| {name} | {' | '.join(cells)} |\n"


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            row(name, scenario, overrides, Path(folder) / str(number))
            for number, (name, (scenario, overrides)) in enumerate(FLIGHTS.items())
        ]
    text = PAGE.read_text()
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    PAGE.write_text(before + BEGIN + HEAD + "".join(rows) + END + after)
