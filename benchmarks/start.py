"""What a start takes: each command as a process of its own, in turn; medians of ROUNDS.

``python benchmarks/start.py [ROUNDS]``, 7 when left out. CPU is the processor time of all threads.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from timing import ROUNDS, alternating, head, row

MJSPACE = (sys.executable, "-m", "mjspace")
RUN = (*MJSPACE, "run", "contraction-ideal", "--duration", "2", "--force", "--out")
COMMANDS = {
    "python alone": ((sys.executable, "-c", ""), None),
    "import mjspace": ((sys.executable, "-c", "import mjspace"), 0.05),
    "mjspace --help": ((*MJSPACE, "--help"), None),
    "mjspace list": ((*MJSPACE, "list"), 0.3),
    "mjspace info contraction-ideal": ((*MJSPACE, "info", "contraction-ideal"), 1.0),
    "mjspace info dgvscmg-tracking": ((*MJSPACE, "info", "dgvscmg-tracking"), 1.0),
    "mjspace run contraction-ideal --duration 2": (RUN, 2.0),
}
"""The words of each command, and its aim [s]."""


def main() -> None:
    """Print the table."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else ROUNDS
    with tempfile.TemporaryDirectory() as folder:
        commands = [(*c, folder) if c is RUN else c for c, _ in COMMANDS.values()]
        times = alternating(*(partial(spent, command) for command in commands), rounds=rounds)
    stored = Path(__file__).parents[1].glob("mjspace/__pycache__/*.pyc")
    head(f"[s], byte code {'stored' if any(stored) else 'not stored'}", "wall", "CPU", "aim")
    for (name, (_, aim)), spans in zip(COMMANDS.items(), np.median(times, axis=0), strict=True):
        row(name, *(f"{s:.2f}" for s in spans), "" if aim is None else f"{aim:g}")


def spent(command: Sequence[str]) -> tuple[float, float]:
    """Return how long the command takes: wall time and processor time [s]."""
    before, start = os.times(), time.perf_counter()
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wall, after = time.perf_counter() - start, os.times()
    if done.returncode > 1:  # 1: flown, but a check of the whole flight failed
        raise SystemExit(f"{' '.join(command)}: exit status {done.returncode}")
    used = after.children_user - before.children_user
    return wall, used + after.children_system - before.children_system


if __name__ == "__main__":
    main()
