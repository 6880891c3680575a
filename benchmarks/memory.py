"""Whether memory grows with the flight: peak resident size of a short and a long one, all logged.

``python benchmarks/memory.py [SHORT LONG]``, in minutes of simulated time; 10 and 60 when left out.
"""

import subprocess
import sys
import tempfile

FLIGHT = """
import resource, sys, warnings
warnings.simplefilter("ignore")
import mjspace
overrides = [f"duration={sys.argv[1]}", "checks=[]"]
mjspace.run("contraction-ideal", overrides=overrides, out=sys.argv[2])
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def main() -> None:
    """Print both figures and their difference [MB]."""
    peaks = [peak(float(minutes)) for minutes in sys.argv[1:3] or ("10", "60")]
    print(
        f"short {peaks[0]:.1f} MB, long {peaks[1]:.1f} MB, difference {peaks[1] - peaks[0]:.1f} MB"
    )


def peak(minutes: float) -> float:
    """Return the peak resident size [MB] of a flight that long, at 1 kHz."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", FLIGHT, str(60.0 * minutes), folder]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    scale = 1e6 if sys.platform == "darwin" else 1e3  # bytes there, kilobytes here
    return int(done.stdout) / scale


if __name__ == "__main__":
    main()
