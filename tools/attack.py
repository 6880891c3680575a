"""Attacks: thousands of damaged and hostile inputs, and what the command line does with them."""

import argparse
import math
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import islice
from pathlib import Path

from rich.progress import track

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests" / "fuzz")]

Findings = list[tuple[str, str]]
"""Name of the case and what was wrong, one for each fault."""


def logs(count: int, seed: int, jobs: int, *, every: bool, keep: Path) -> Iterator[Findings]:
    """Yield the findings of damaged and foreign logs, some cases at a time."""
    from logs import BASES

    from mjspace.runner.run import run

    with tempfile.TemporaryDirectory() as folder:
        bases = {
            name: run(name, overrides=overrides, out=Path(folder) / name).path
            for name, overrides in BASES.items()
        }
        share = math.ceil(count / jobs)
        with ProcessPoolExecutor(jobs) as pool:
            steps = range(0, share, BATCH)
            tasks = [
                pool.submit(_some_logs, bases, f"{seed}-{job}", share, step, every, keep)
                for step in steps
                for job in range(jobs)
            ]
            for task in tasks:
                yield task.result()


BATCH = 10
"""Cases from one progress report to the next."""


def _some_logs(
    bases: dict[str, Path], seed: str, share: int, first: int, every: bool, keep: Path
) -> Findings:
    from log_attack import attack
    from logs import cases

    import mjspace.cli
    import mjspace.rendering.render
    import mjspace.runner.report  # noqa: F401
    from mjspace.plotting.page import plot
    from mjspace.runner.replay import verify

    for base in bases.values():
        if base not in _warm:
            verify(base)  # what is compiled for a flight is then shared by all forks
            plot(base, base.with_suffix(".png"))
            _warm.add(base)
    found = []
    for case in islice(cases(bases, f"{seed}-{first}"), min(BATCH, share - first)):
        with tempfile.TemporaryDirectory() as folder:
            faults = list(attack(case, Path(folder), every=every))
        name = f"{seed}-{first}-{case.name}"
        found += [(name, fault) for fault in faults]
        if faults:
            keep.mkdir(parents=True, exist_ok=True)
            (keep / f"{name}.mcap").write_bytes(case.content)
    return found


_warm: set[Path] = set()
ATTACKS: dict[str, Callable[..., Iterator[Findings]]] = {"logs": logs}


def main() -> int:
    """Run one attack; return 1 where there were findings."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=ATTACKS)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--seed", type=int, default=None, help="of the cases; else the time's")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--every", action="store_true", help="every command on each case")
    parser.add_argument("--keep", type=Path, default=ROOT / "build" / "attack")
    chosen = parser.parse_args()
    seed = int(time.time()) if chosen.seed is None else chosen.seed
    begin, found = time.monotonic(), []
    batches = ATTACKS[chosen.what](
        chosen.cases, seed, chosen.jobs, every=chosen.every, keep=chosen.keep / chosen.what
    )
    total = chosen.jobs * math.ceil(math.ceil(chosen.cases / chosen.jobs) / BATCH)
    for batch in track(batches, f"{chosen.what}, seed {seed}", total):
        for name, fault in batch:
            print(f"{name}: {fault}", flush=True)
        found += batch
    seconds = time.monotonic() - begin
    kinds = Counter(fault.split(":")[1].strip() for _, fault in found)
    print(
        f"{chosen.what}: {chosen.cases} cases, seed {seed}, {seconds:.0f} s: {len(found)} findings"
        + "".join(f"; {kind} {count}" for kind, count in kinds.most_common(5))
    )
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
