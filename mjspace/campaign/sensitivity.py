"""Sobol indices: what share of a number's variance over a campaign each dispersion explains."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from mjspace.campaign.statistics import CONFIDENCE
from mjspace.contract import Array
from mjspace.errors import InputError

SAMPLING = "saltelli"
RESAMPLES = 999


@dataclass(frozen=True)
class Index:
    """A share of the variance, with its interval by bootstrap."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Sensitivity:
    """How a check's margin, or a metric, depends on what was drawn."""

    name: str
    groups: int
    """Of members, each with its own draws, that it is estimated from."""
    why: str
    """Why there are no indices; empty where there are."""
    first: dict[str, Index]
    """Of each dispersion, by its key: the share that it explains alone."""
    total: dict[str, Index]
    """The share that it has part in, with all others."""


def group_size(count: int) -> int:
    """Return how many members a group has, for ``count`` dispersions.

    They are those of A, of B, and of A with one dispersion at a time as in B: A. Saltelli et al.
    2010, Computer Physics Communications 181, 259, "radial" design.
    """
    return count + 2


def refuse_unfit(keys: Sequence[str], count: int) -> None:
    """Refuse a number of members of which no indices could be estimated.

    Raises:
        InputError: with the numbers that are near.
    """
    if len(keys) < 2:
        raise InputError(f"sampling {SAMPLING!r}: needs two or more dispersions, has {len(keys)}")
    size = group_size(len(keys))
    below = size * 2 ** max(1, (max(count // size, 1)).bit_length() - 1)
    if count != below:
        raise InputError(
            f"--n {count}: with sampling {SAMPLING!r} and {len(keys)} dispersions it should be "
            f"{size} times a power of two: {below} or {2 * below}"
        )


def independent(members: Array, count: int) -> NDArray[np.bool_]:
    """Return which of the members have draws of their own, as those of A and B."""
    return np.less(members % group_size(count), 2)


def indices(
    name: str, keys: Sequence[str], values: Array, confidence: float = CONFIDENCE
) -> Sensitivity:
    """Return the indices of ``values`` (n,) of the first n members, nan where one has none.

    They are estimated from a power of two of whole groups, as many as there are.
    """
    size = group_size(len(keys))
    whole = len(values) // size
    groups = 2 ** (whole.bit_length() - 1) if whole else 0
    if groups < 2:
        return Sensitivity(name, groups, f"needs {2 * size} members", {}, {})
    table = values[: groups * size].reshape(groups, size).T
    if not np.isfinite(table).all():
        lacking = int((~np.isfinite(table)).sum())
        return Sensitivity(name, groups, f"{lacking} members have no value", {}, {})
    if np.ptp(table) <= 1e-12 * np.abs(table).max():
        return Sensitivity(name, groups, "it is the same for every member", {}, {})

    def both(chosen: Array) -> Array:
        f = table[:, chosen]
        of = {"f_A": f[:1], "f_B": f[1:2], "f_AB": f[2:, None]}
        found = stats.sobol_indices(func=of, n=groups)
        return np.array([found.first_order, found.total_order])

    whole_sample = np.arange(groups)
    found = both(whole_sample)
    interval = stats.bootstrap(
        [whole_sample],
        both,
        n_resamples=RESAMPLES,
        confidence_level=confidence,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    first, total = (
        {
            key: Index(float(value), float(low), float(high))
            for key, value, low, high in zip(keys, *order, strict=True)
        }
        for order in zip(found, interval.low, interval.high, strict=True)
    )
    return Sensitivity(name, groups, "", first, total)
