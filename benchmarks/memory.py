"""What a flight takes of memory, and how that grows with its length, its wheels and its members.

``python benchmarks/memory.py [MINUTES...]``: of simulated time, the lengths of the logged flights;
1, 10 and 30 when left out. Each flight has a process of its own, whose peak resident size it is;
that of a process which has assembled the vehicle and not flown is subtracted where it says so.
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
FLIGHT = """
import json, resource, sys, time, warnings
warnings.simplefilter("ignore")
from flights import built, flight, logged, steps_of
asked = json.loads(sys.argv[1])
vehicle = built(asked["scenario"], *asked["changes"])
run = logged(vehicle) if asked["logged"] else flight(vehicle, asked["members"])
times = []
for _ in range(asked["runs"]):
    start = time.perf_counter()
    run()
    times.append(time.perf_counter() - start)
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
step = 1e6 * min(times, default=0.0) / steps_of(vehicle) / asked["members"]
print(json.dumps({"peak": peak, "step": step}))
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
    head("wheels, 1 kHz, all logged", "peak [MB]", "us a step")
    for count in WHEELS:
        size, step = peak(*wheels(count), "duration=5", logged=True, runs=3)
        row(str(count), f"{size:.1f}", f"{step:.1f}")
    print()
    head("members of a batch, not logged", "peak [MB]", "MB each", "us a step")
    ground = peak(runs=0)[0]
    for count in MEMBERS:
        size, step = peak("duration=0.5", members=count)
        row(str(count), f"{size:.1f}", f"{(size - ground) / count:.2f}", f"{step:.1f}")
    print(f"\nA process that has not flown has {ground:.1f} MB, which `MB each` leaves out.")


def peak(
    *changes: str, logged: bool = False, members: int = 1, runs: int = 1
) -> tuple[float, float]:
    """Return the peak resident size [MB] of a process of flights, and the least time of a step."""
    asked: dict[str, Any] = {
        "scenario": "three_wheels.toml",
        "changes": changes,
        "logged": logged,
        "members": members,
        "runs": runs,
    }
    command = [sys.executable, "-c", FLIGHT, json.dumps(asked)]
    done = subprocess.run(command, cwd=HERE, check=True, capture_output=True, text=True)
    answer = json.loads(done.stdout)
    scale = 1e6 if sys.platform == "darwin" else 1e3  # bytes there, kilobytes here
    return answer["peak"] / scale, answer["step"]


def wheels(count: int) -> tuple[str, str]:
    """Return the changes that give the vehicle so many wheels, along its axes in turn."""
    axes = [[float(k == i % 3) for k in range(3)] for i in range(count)]
    speeds = [(100.0, -50.0, 20.0)[i % 3] for i in range(count)]
    return f"plant.wheels.axes={axes}", f"initial.wheel_speed={speeds}"


if __name__ == "__main__":
    main()
