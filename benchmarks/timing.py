"""How the benchmarks measure: runs in turn, medians of their ratios, rows of a Markdown table."""

import time
from collections.abc import Callable, Sequence

import numpy as np

from mjspace.contract import Array

ROUNDS = 7

Run = Callable[[], object]


def alternating(*timers: Callable[[], float | Sequence[float]], rounds: int = ROUNDS) -> Array:
    """Return what each timer returns in turn, after a round that does not count, (rounds, n, ...).

    Neighbours see the same machine, which others may slow down or speed up meanwhile.
    """
    return np.array([[timer() for timer in timers] for _ in range(rounds + 1)])[1:]


def paired(*runs: Run, rounds: int = ROUNDS) -> Array:
    """Return the wall time [s] of each of the runs in turn, (rounds, n)."""
    return alternating(*(lambda run=run: seconds(run) for run in runs), rounds=rounds)


def ratio(times: Array) -> float:
    """Return the median of the ratios of the first column to the last."""
    return float(np.median(times[:, 0] / times[:, -1]))


def seconds(run: Run) -> float:
    """Return how long ``run`` takes."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def head(*cells: str) -> None:
    """Print the head of a table."""
    row(*cells)
    print("|".join(["", "---", *("--:" for _ in cells[1:]), ""]), flush=True)


def row(*cells: str) -> None:
    """Print a row of a table."""
    first, *others = cells
    print("|", " | ".join([first.ljust(48), *(cell.rjust(8) for cell in others)]), "|", flush=True)
