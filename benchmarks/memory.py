"""What a flight takes of memory and time, as its length, its wheels and its members grow.

``python benchmarks/memory.py [MINUTES...]``: of simulated time, the lengths of the logged flights;
1, 10 and 30 when left out. Each flight has a process of its own, whose peak resident size it is.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from timing import head, row

HERE = Path(__file__).parent
WHEELS = (3, 6, 12)
MEMBERS = (1, 16, 256, 1024)
MOST_TIMED = 256
FLIGHT = """
import json, resource, sys, warnings
warnings.simplefilter("ignore")
from flights import bare_batch, built, flight, logged, steps_of
from timing import paired, ratio
asked = json.loads(sys.argv[1])
vehicle, members = built(asked["scenario"], *asked["changes"]), asked["members"]
run = logged(vehicle) if asked["logged"] else flight(vehicle, members)
if asked["flown"]:
    run()
peak, over = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, 0.0
if asked["timed"]:
    over = ratio(paired(run, bare_batch(vehicle, members, 1, steps_of(vehicle)), rounds=3))
print(json.dumps({"peak": peak, "ratio": over}))
"""


def main() -> None:
    """Print the tables."""
    minutes = [float(each) for each in sys.argv[1:]] or [1.0, 10.0, 30.0]
    head("length of a flight, 1 kHz, all logged", "peak [MB]", "growth")
    peaks = []
    for each in minutes:
        peaks.append(peak(f"duration={60.0 * each}", logged=True)[0])
        row(f"{each:g} min", f"{peaks[-1]:.1f}", f"{peaks[-1] - peaks[0]:.1f}")
    print()
    head("wheels, 1 kHz, all logged", "peak [MB]", "ratio")
    for count in WHEELS:
        size, ratio = peak(*wheels(count), "duration=5", logged=True, timed=True)
        row(str(count), f"{size:.1f}", f"{ratio:.2f}")
    print()
    head("members of a batch, not logged", "peak [MB]", "MB each", "ratio")
    ground = peak(flown=False)[0]
    for count in MEMBERS:
        size, ratio = peak("duration=0.5", members=count, timed=count <= MOST_TIMED)
        over = f"{ratio:.2f}" if ratio else ""
        row(str(count), f"{size:.1f}", f"{(size - ground) / count:.2f}", over)
    print(
        f"\nA process that has not flown has {ground:.1f} MB, which `MB each` leaves out. `ratio` is "
        "the time over bare steps of MuJoCo's batch, set-up included: of 5 s with wheels, 0.5 s of "
        "members."
    )


def peak(
    *changes: str, logged: bool = False, members: int = 1, flown: bool = True, timed: bool = False
) -> tuple[float, float]:
    """Return the peak resident size [MB] of a process with a flight, and its time over bare steps.

    0.0 for the time where it is not taken.
    """
    asked: dict[str, Any] = {
        "scenario": "three_wheels.toml",
        "changes": changes,
        "logged": logged,
        "members": members,
        "flown": flown,
        "timed": timed,
    }
    command = [sys.executable, "-c", FLIGHT, json.dumps(asked)]
    done = subprocess.run(command, cwd=HERE, check=True, capture_output=True, text=True)
    answer = json.loads(done.stdout)
    scale = 1e6 if sys.platform == "darwin" else 1e3  # bytes there, kilobytes here
    return answer["peak"] / scale, answer["ratio"]


def wheels(count: int) -> tuple[str, str]:
    """Return the changes that give the vehicle so many wheels, along its axes in turn."""
    axes = [[float(k == i % 3) for k in range(3)] for i in range(count)]
    speeds = [(100.0, -50.0, 20.0)[i % 3] for i in range(count)]
    return f"plant.wheels.axes={axes}", f"initial.wheel_speed={speeds}"


if __name__ == "__main__":
    main()
