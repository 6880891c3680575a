"""Two campaigns on the same draws, as of two laws: which one works where the other does not."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import stats

from mjspace.campaign.results import Results, value_column
from mjspace.campaign.statistics import CONFIDENCE
from mjspace.contract import Array
from mjspace.errors import InputError

MARGIN = ": margin"


@dataclass(frozen=True)
class Paired:
    """A check or a metric that both campaigns have, over the members of which both measured it."""

    name: str
    members: int
    larger: float
    """Share of the members with a larger margin, or value, in the second."""
    difference: float
    """Median of the second's margin or value less the first's, in the signal's unit."""
    interval: tuple[float, float]
    """Of the median, at the confidence: by order statistics, for any distribution. Of fewer than
    six members all that there is, which has less confidence."""


@dataclass(frozen=True)
class Pairs:
    """The members that both campaigns have flown."""

    both: int
    """Members that succeed in both."""
    first: int
    """In the first alone."""
    second: int
    neither: int
    checks: list[Paired]
    metrics: list[Paired]
    confidence: float = CONFIDENCE

    @property
    def members(self) -> int:
        """How many there are."""
        return self.both + self.first + self.second + self.neither

    @property
    def difference(self) -> float:
        """The second's success rate less the first's."""
        return (self.second - self.first) / self.members

    @property
    def interval(self) -> tuple[float, float]:
        """Of the difference: Agresti and Min 2005, Statistics in Medicine 24, 729."""
        n, less, more = self.members + 2.0, self.first + 0.5, self.second + 0.5
        middle = (more - less) / n
        spread = math.sqrt(less + more - (more - less) ** 2 / n) / n
        reach = float(stats.norm.ppf(0.5 + 0.5 * self.confidence)) * spread
        return max(-1.0, middle - reach), min(1.0, middle + reach)

    @property
    def probability(self) -> float:
        """Of at least so large a difference, were both equally good: McNemar's exact test."""
        differing = self.first + self.second
        if not differing:
            return 1.0
        return float(stats.binomtest(self.first, differing).pvalue)


def compare(first: Path, second: Path) -> Pairs:
    """Return what two campaigns show of the members that both have flown.

    Raises:
        InputError: a folder holds no campaign; no member is in both; or one drew something else in
            the second.
    """
    one, two = Results(first), Results(second)
    member, other = (results.column("member") for results in (one, two))
    common, i, j = np.intersect1d(member, other, assume_unique=True, return_indices=True)
    if not len(common):
        raise InputError(f"{first} and {second} have no member in common")
    for name in ["seed", *(n for n in _drawn(one) if n in two.columns)]:
        differ = one.column(name)[i] != two.column(name)[j]
        if differ.any():
            raise InputError(
                f"{first} and {second} differ in {name} of member {common[differ][0]:.0f}: fly "
                "both with the same seed, sampling and dispersions"
            )
    well, good = one.column("passed")[i] > 0.5, two.column("passed")[j] > 0.5

    def paired(ending: str) -> list[Paired]:
        names = [name for name in one.columns if name.endswith(ending) and name in two.columns]
        found = (
            _paired(name.removesuffix(ending), one.column(name)[i], two.column(name)[j])
            for name in names
        )
        return [each for each in found if each is not None]

    return Pairs(
        both=int(np.sum(well & good)),
        first=int(np.sum(well & ~good)),
        second=int(np.sum(~well & good)),
        neither=int(np.sum(~well & ~good)),
        checks=paired(MARGIN),
        metrics=paired(value_column("")),
    )


def _paired(name: str, one: Array, two: Array) -> Paired | None:
    """Return how margins or values compare; None where no member has both."""
    differences = np.sort((two - one)[np.isfinite(two - one)])
    count = len(differences)
    if not count:
        return None
    low = max(int(stats.binom.ppf(0.5 - 0.5 * CONFIDENCE, count, 0.5)) - 1, 0)
    return Paired(
        name=name,
        members=count,
        larger=float(np.mean(differences > 0.0)),
        difference=float(np.median(differences)),
        interval=(float(differences[low]), float(differences[count - 1 - low])),
    )


def _drawn(results: Results) -> list[str]:
    """Return the names of what was drawn: the columns ahead of the checks and metrics."""
    names, after = results.columns, (": measured", value_column(""), "trouble")
    ends = (n for n, name in enumerate(names) if name.endswith(after))
    return names[names.index("passed") + 1 : next(ends)] if names else []
