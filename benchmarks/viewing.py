"""How soon a long log is looked at, as a person sees it: the start of each process included.

``python benchmarks/viewing.py [MINUTES]``: of ten minutes at 1 kHz when left out. Of ``mjspace
view`` it is the time until its page is served, with the first moment drawn, and the most memory
that the process had once its plots were there. Of the others it is the whole time.
"""

import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

from timing import head, row

import mjspace

PORT = 18080
PLOTS = 15.0
"""s, in which the plots are there."""


def main() -> None:
    """Print the table."""
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    body = "plant.gyrostat_inertia=[[15,1,1],[1,12,1],[1,1,18]]"
    with tempfile.TemporaryDirectory() as folder:
        overrides = [f"duration={60.0 * minutes}", "checks=[]", body]
        log = mjspace.run("contraction-ideal", overrides=overrides, out=folder).path
        head(f"{log.stat().st_size / 1e6:.0f} MB, {minutes:g} min at 1 kHz", "s", "MB at most")
        row("`mjspace view`", *viewed(log))
        for words in (["info"], ["report", "-o", str(Path(folder, "report.html"))]):
            row(f"`mjspace {words[0]}`", *called([words[0], str(log), *words[1:]]))


def viewed(log: Path) -> tuple[str, str]:
    """Return the seconds until the page is served, and the most memory [MB]."""
    began = time.perf_counter()
    process = start(["view", str(log), "--port", str(PORT)])
    try:
        while True:
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{PORT}", timeout=1.0).close()
                break
            except OSError:
                time.sleep(0.01)
        served = time.perf_counter() - began
        time.sleep(PLOTS)
        status = Path(f"/proc/{process.pid}/status").read_text()
        peak = int(status.partition("VmHWM:")[2].split()[0]) / 1e3
    finally:
        process.terminate()
        process.wait()
    return f"{served:.2f}", f"{peak:.0f}"


def called(words: list[str]) -> tuple[str, str]:
    """Return the seconds that a command takes; of its memory nothing is known."""
    began = time.perf_counter()
    if start(words).wait() != 0:
        raise SystemExit(f"mjspace {words[0]} failed")
    return f"{time.perf_counter() - began:.2f}", ""


def start(words: list[str]) -> "subprocess.Popen[bytes]":
    return subprocess.Popen([sys.executable, "-m", "mjspace", *words], stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main()
