"""The draws of a campaign's members, from the seed, the member and the sampling alone."""

import math
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import special, stats
from scipy.stats import qmc

from mjspace.campaign.sensitivity import SAMPLING, group_size
from mjspace.contract import Array
from mjspace.scenario.dispersions import Dispersion

WIDTH = {"random_attitude": 3, "on_sphere": 2}
"""Uniform numbers that a draw takes; 1 for every other distribution."""
_LEAST = 2.0**-53  # of numbers in [0, 1): the inverse of a normal distribution at 0 is infinite


def uniforms(
    sampling: str, seed: int, members: Sequence[int], count: int, dispersions: Sequence[Dispersion]
) -> Array:
    """Return the uniform numbers of these of the ``count`` members, (len(members), width).

    A member's are the same in whatever company it is drawn. Those of a Latin
    hypercube alone depend on ``count`` as well.
    """
    width = width_of(dispersions)
    if not width or not len(members):
        return np.empty((len(members), width))
    if sampling == "random":
        streams = [np.random.SeedSequence(seed, spawn_key=(member,)) for member in members]
        points = np.array([np.random.default_rng(stream).random(width) for stream in streams])
    elif sampling == SAMPLING:
        points = _exchanged(seed, members, dispersions)
    else:
        rng = np.random.default_rng(seed)
        kind = {"latin_hypercube": qmc.LatinHypercube, "sobol": qmc.Sobol}[sampling]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # any number of members may fly, not powers of 2 alone
            points = kind(width, rng=rng).random(count)[list(members)]
    inside: Array = np.clip(points, _LEAST, 1.0 - _LEAST)
    return inside


def _exchanged(seed: int, members: Sequence[int], dispersions: Sequence[Dispersion]) -> Array:
    """Return the points of groups in which one dispersion at a time is exchanged.

    The members of a group are A, B, and A with the numbers of the first dispersion as in B, of the
    second, and so on. A and B are halves of a point of one Sobol sequence.
    """
    widths = [width_of([each]) for each in dispersions]
    ends = np.cumsum(widths)
    width, size = int(ends[-1]), group_size(len(dispersions))
    groups = max(members) // size + 1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a member alone needs those up to its own
        pairs = qmc.Sobol(2 * width, rng=np.random.default_rng(seed)).random(groups)
    points = np.empty((len(members), width))
    for row, member in zip(points, members, strict=True):
        group, place = divmod(member, size)
        one, other = pairs[group, :width], pairs[group, width:]
        row[:] = other if place == 1 else one
        if place > 1:
            part = slice(ends[place - 2] - widths[place - 2], ends[place - 2])
            row[part] = other[part]
    return points


def width_of(dispersions: Sequence[Dispersion]) -> int:
    """Return how many uniform numbers a member draws."""
    return sum(len(each.keys or ()) or WIDTH.get(each.distribution, 1) for each in dispersions)


def values(dispersions: Sequence[Dispersion], nominal: Sequence[Any], row: Array) -> list[Any]:
    """Return what a member's uniform numbers (width,) make of each dispersion, in SI.

    ``nominal`` are the scenario's own values.
    """
    found, place = [], 0
    for dispersion, own in zip(dispersions, nominal, strict=True):
        width = width_of([dispersion])
        found.append(value(dispersion, own, row[place : place + width]))
        place += width
    return found


def value(dispersion: Dispersion, nominal: Any, u: Array) -> Any:
    """Return the number, or the vector as a list, that the uniform numbers ``u`` make."""
    d: Any = dispersion
    match d.distribution:
        case "normal" if d.covariance is not None:
            return correlated(np.array(d.covariance), nominal, u)
        case "normal":
            mean = nominal if d.mean is None else d.mean
            return float(mean + d.std * special.ndtri(u[0]))
        case "uniform":
            return float(d.low + (d.high - d.low) * u[0])
        case "log_uniform":
            return float(stats.loguniform.ppf(u[0], d.low, d.high))
        case "triangular":
            mode = nominal if d.mode is None else d.mode
            span = d.high - d.low
            return float(stats.triang.ppf(u[0], (mode - d.low) / span, d.low, span))
        case "discrete":
            chosen = d.values[int(u[0] * len(d.values))]
            whole = isinstance(nominal, int) and chosen == int(chosen)
            return int(chosen) if whole else float(chosen)
        case "random_attitude":
            return random_attitude(u)
        case _:
            return [float(d.radius * x) for x in direction(u)]


def correlated(covariance: Array, mean: Sequence[float], u: Array) -> list[float]:
    """Return normal numbers about ``mean`` (n,), of uniform numbers ``u`` (n,).

    The covariance may be singular: its square root is by eigenvectors.
    """
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    found: list[float] = (np.array(mean) + root @ special.ndtri(u)).tolist()
    return found


def random_attitude(u: Array) -> list[float]:
    """Return a quaternion, evenly distributed over all rotations, of uniform numbers ``u`` (3,).

    Shoemake 1992, "Uniform random rotations", Graphics Gems III.
    """
    inner, outer = math.sqrt(1.0 - u[0]), math.sqrt(u[0])
    one, other = 2.0 * math.pi * u[1], 2.0 * math.pi * u[2]
    return [
        outer * math.cos(other),
        inner * math.sin(one),
        inner * math.cos(one),
        outer * math.sin(other),
    ]


def direction(u: Array) -> list[float]:
    """Return a unit vector, evenly distributed over the sphere, of uniform numbers ``u`` (2,).

    Its height is evenly distributed: Archimedes' hat-box theorem.
    """
    z, angle = 2.0 * u[0] - 1.0, 2.0 * math.pi * u[1]
    aside = math.sqrt(1.0 - z * z)
    return [aside * math.cos(angle), aside * math.sin(angle), z]
