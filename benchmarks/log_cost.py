"""What logging and judging cost: the thread that flies, which hands blocks over, and the log's own.

    python benchmarks/log_cost.py

contraction-adaptive at 1 kHz, 20 s, flown first; then its blocks are handed over one after the
other. The first log of a model packs it, the next one does not.
"""

import tempfile
import time
import warnings
from pathlib import Path

from timing import head, row

from mjspace.runner.recorder import Recorder
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import Assembly, assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly
from mjspace.simulation.recording import Block

ROUNDS = 4
RATES = ((), ("log.default='100 Hz'", "log.state='1 s'"))


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore")
    head("us a control period", "file", "flying", "log", "wall")
    for rates in RATES:
        assembly = assemble(*load("contraction-adaptive", ["duration=20", *rates]))
        blocks = list(fly(assembly, first_start(assembly, [0])))
        for number in range(ROUNDS):
            report(f"{' '.join(rates) or 'every control period'}, {number + 1}", assembly, blocks)


def report(name: str, assembly: Assembly, blocks: list[Block]) -> None:
    """Print the log's size, and processor time of both threads and wall time for each period."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "flight.mcap"
        begin = time.thread_time(), time.process_time(), time.perf_counter()
        with Recorder(assembly) as recorder:
            recorder.begin(path, 0, blocks[0])
            for block in blocks:
                recorder.write(block)
            recorder.verdicts()
        flying = time.thread_time() - begin[0]
        log = time.process_time() - begin[1] - flying
        wall = time.perf_counter() - begin[2]
        size = path.stat().st_size / 1e6
    scale = 1e6 / sum(len(block.time) for block in blocks)
    row(name, f"{size:.1f} MB", *(f"{scale * time:.2f}" for time in (flying, log, wall)))


if __name__ == "__main__":
    main()
