"""The same satellite flown here and in Basilisk, in turn in one run: wall time of a step.

``python benchmarks/against_basilisk.py [PYTHON]``: an interpreter that has bsk, the one of ``make
validation`` when left out. Both fly three_wheels.toml by RK4. Logged, mjspace writes every topic to
a compressed file; Basilisk records state, wheels, error, command and motors in memory.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import own_law
from flights import built, flight, logged, steps_of
from timing import alternating, head, ratio, row, seconds

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.constants import GM
from mjspace.runner.run import fly_to_log
from mjspace.simulation.assembly import Assembly

HERE = Path(__file__).parent
PYTHON = HERE.parent / "build/basilisk/bin/python"
EVERY = 1000  # steps between compared rows, as in basilisk_wheels.py
LARGEST = 1e-10  # of the difference, in any component of the motion
ELEMENTS = (
    *("semi_major_axis", "eccentricity", "inclination"),
    *("ascending_node", "periapsis", "true_anomaly"),
)


def main() -> None:
    """Print the table, once both have flown the same motion."""
    python = sys.argv[1] if len(sys.argv) > 1 else str(PYTHON)
    found = (
        subprocess.run([python, "-c", "import Basilisk"], capture_output=True)
        if (Path(python).exists())
        else None
    )
    if found is None or found.returncode:
        print(f"not measured: {python} has no bsk (make build/basilisk.done)")
        return
    craft = built(HERE / "three_wheels.toml")
    command = [python, str(HERE / "basilisk_wheels.py")]

    def theirs(recorded: bool) -> dict[str, Any]:
        request = json.dumps(vehicle(craft) | {"logged": recorded}) + "\n"
        done = subprocess.run(command, input=request, capture_output=True, text=True, check=True)
        answer: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
        return answer

    off = difference(craft, theirs(True))
    if not off < LARGEST:
        raise SystemExit(f"the motions differ by {off:.1e}: no time is compared")
    head("wall time of a step [us]", "mjspace", "Basilisk", "ratio", "aim")
    steps = steps_of(craft)
    for name, recorded, aim in (("both log", True, "0.59"), ("neither logs", False, "")):
        run = logged(craft) if recorded else flight(craft)
        times = alternating(
            lambda run=run: seconds(run),  # type: ignore[misc]
            lambda recorded=recorded: theirs(recorded)["seconds"],  # type: ignore[misc]
        )
        each = 1e6 * np.median(times, axis=0) / steps
        row(name, *(f"{us:.1f}" for us in each), f"{ratio(times):.2f}", aim)
    print(f"\nThe motions differ by at most {off:.0e} (MRP, rad/s, relative wheel speed).")


def vehicle(craft: Assembly) -> dict[str, Any]:
    """Return the scenario as ``basilisk_wheels`` reads it, in SI units."""
    scenario, law = craft.scenario, own_law.Feedback()
    wheels, initial = scenario.plant.wheels, scenario.initial
    axes = np.array(wheels.axes, float)
    return {
        "step": scenario.rates.physics,
        "duration": scenario.duration,
        "mass": scenario.plant.mass + wheels.mass * len(axes),
        "inertia": (craft.vehicle.inertia + wheels.inertia * axes.T @ axes).tolist(),
        "gm": GM["earth"],
        "orbit": [getattr(scenario.environment.orbit, name) for name in ELEMENTS],
        "mrp": attitude.to_mrp(attitude.normalize(np.array(initial.attitude))).tolist(),
        "rate": initial.rate,
        "axes": axes.tolist(),
        "wheel_inertia": wheels.inertia,
        "wheel_speed": initial.wheel_speed,
        "stiffness": law.stiffness,
        "damping": law.damping,
    }


def difference(craft: Assembly, theirs: dict[str, Any]) -> float:
    """Return the largest difference of attitude [MRP], rate [rad/s], and wheel speed, relative."""
    with tempfile.TemporaryDirectory() as folder:
        log = fly_to_log(craft, Path(folder) / "flight.mcap").log
        truth = log.read("/truth", ["attitude", "rate", "wheel_speed"], every=EVERY)
    speed: Array = np.array(theirs["wheel_speed"])
    return max(
        np.abs(attitude.to_mrp(truth["attitude"]) - theirs["mrp"]).max(),
        np.abs(truth["rate"] - theirs["rate"]).max(),
        np.abs(truth["wheel_speed"] - speed).max() / np.abs(speed).max(),
    )


if __name__ == "__main__":
    main()
