"""What a control period costs under a law in Python, in a shared library and in another process.

The same feedback (``own_law.py``, ``own_law.c``) of one satellite at 1 kHz, not logged. It needs
a C compiler, ``cc``.
"""

import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from flights import bare_steps, built, flight, steps_of
from timing import head, paired, row

HERE = Path(__file__).parent
SCENARIO = HERE / "three_wheels.toml"
PERIODS = ("duration=5", "rates.control='1 ms'")
GAINS = ("law.stiffness=60", "law.damping=60")
SIGNALS = "law.signals.sigma.shape=[3]"


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder, listening() as address:
        laws = {
            "Python, compiled": ["law.kind=own_law.py:Feedback"],
            "Python, called in each period": ["law.kind=own_law.py:Branching"],
            "shared library": [f"law.kind={compiled(Path(folder))}:feedback", SIGNALS],
            "another process": [f"law.kind={address}"],
        }
        vehicles = [built(SCENARIO, *kind, *GAINS, *PERIODS) for kind in laws.values()]
        steps = steps_of(vehicles[0])
        times = paired(*map(flight, vehicles), bare_steps(vehicles[0], steps))
    above = times[:, :-1] - times[:, -1:]
    head("a law of 20 lines, 1 kHz", "us a period", "above bare", "ratio")
    for number, name in enumerate(laws):
        us = 1e6 * np.median(times[:, number]) / steps
        ratio = np.median(above[:, number] / above[:, 1])
        row(name, f"{us:.1f}", f"{1e6 * np.median(above[:, number]) / steps:.1f}", f"{ratio:.2f}")


def compiled(folder: Path) -> Path:
    """Return the library of ``own_law.c``, compiled in the folder."""
    path = folder / "own_law.so"
    overrides = (f"law.kind={path}:feedback", *GAINS, SIGNALS)
    options = [word for override in overrides for word in ("--set", override)]
    header = [sys.executable, "-m", "mjspace", "law-header", str(SCENARIO), *options]
    subprocess.run([*header, "-o", folder / "own_law.h"], check=True, stdout=subprocess.DEVNULL)
    command = ["cc", "-std=c99", "-O2", "-shared", "-fPIC", "-I", folder, "-o", path]
    subprocess.run([*command, HERE / "own_law.c"], check=True)
    return path


@contextmanager
def listening() -> Iterator[str]:
    """Yield the address at which the law in Python listens, in a process of its own."""
    command = [sys.executable, "-m", "mjspace", "serve-law", "own_law.py:Feedback", "--port", "0"]
    with subprocess.Popen(command, cwd=HERE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().split()[3].rstrip(";")
        finally:
            process.kill()


if __name__ == "__main__":
    main()
