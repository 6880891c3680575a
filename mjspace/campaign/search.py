"""Minimizing what flights show, by the evolution strategy CMA-ES of the package cma."""

import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from scipy.stats import qmc

from mjspace.contract import Array
from mjspace.errors import missing

EXPLORED = 16
"""Points of a Sobol sequence before each descent, which begins at the best of all of them."""
STEP = 0.2
"""First standard deviation of a descent's points, of a box of unit size."""
GAIN = 0.05
"""By how much of the best value a generation has to better it, lest the descent be ended."""
_WORST = 1e12
"""What an infinite value counts as."""
Evaluate = Callable[[Array], Array]
"""Returns the values (n,) of points (n, width) in the unit box."""


def minimize(
    evaluate: Evaluate, width: int, budget: int, seed: int, *, patience: int | None = 2
) -> Iterator[tuple[Array, Array]]:
    """Yield points in the unit box (n, width) and their values (n,), as they are evaluated.

    ``budget`` points are evaluated in all. CMA-ES descends (N. Hansen, "The CMA evolution strategy:
    a tutorial", arXiv 1604.00772) from the best of some points that are spread over the box. A
    descent that has converged, or that has not got on for ``patience`` generations in a row, is
    followed by another from other points: what fails may be elsewhere. The points depend on
    ``seed`` and the values alone.

    Raises:
        InputError: the package is not installed.
    """
    rng, spent = np.random.default_rng(seed), 0
    spread, seen = qmc.Sobol(width, rng=rng), list[tuple[float, Array]]()

    def flown(points: Array) -> Array:
        nonlocal spent
        values = evaluate(points[: budget - spent])
        spent += len(values)
        return np.clip(np.nan_to_num(values, nan=_WORST), -_WORST, _WORST)

    while spent < budget:
        points = spread.random(EXPLORED)
        values = flown(points)
        yield points[: len(values)], values
        seen += list(zip(values.tolist(), points, strict=False))
        seen.sort(key=lambda each: each[0])
        best, start = seen.pop(0)
        descent, idle = _descent(start, int(rng.integers(1, 2**31))), 0
        while spent < budget and not descent.stop() and (patience is None or idle < patience):
            points = np.array(descent.ask())
            values = flown(points)
            yield points[: len(values)], values
            if len(values) < len(points):
                return
            descent.tell(list(points), values.tolist())
            least = float(values.min())
            idle = 0 if least < best - GAIN * abs(best) else idle + 1
            best = min(best, least)


def _descent(start: Array, seed: int) -> Any:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import cma
    except ImportError:
        raise missing("a search", "cma", "search") from None
    size = 4 + int(3.0 * np.log(max(len(start), 2)))
    options = {"bounds": [0.0, 1.0], "seed": seed, "popsize": size + size % 2, "verbose": -9}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a single number, which it advises against
        return cma.CMAEvolutionStrategy(start, STEP, options)
