"""Hazards of a landing site in a map of heights: slope and roughness of each footprint.

A plane is fitted by least squares to the heights within a footprint; its steepness is the slope,
the largest distance of those heights from it the roughness. Sites are judged by these two in
A. E. Johnson, A. R. Klumpp, J. B. Collier and A. A. Wolf, "Lidar-based hazard avoidance for safe
landing on Mars", Journal of Guidance, Control, and Dynamics 25 (2002).
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from mjspace.contract import Array


class Sites(NamedTuple):
    """The planned site and the safe one: x, y and the height of the ground, each (3,) [m]."""

    planned: Array
    safe: Array


def slope_and_roughness(heights: Array, spacing: float, footprint: float) -> tuple[Array, Array]:
    """Return the slope [rad] and the roughness [m] at each point of a map, both as ``heights``.

    ``heights`` (m, n) [m] has rows along y and columns along x, ``spacing`` [m] apart;
    ``footprint`` [m] is the radius of the disc about the point. Where it leaves the map both are
    infinite. The disc has the same points on both sides of each axis, so that the plane's mean and
    its two slopes are fitted one by one.

    Raises:
        ValueError: the footprint has no neighbour in it, or is wider than the map.
    """
    reach = int(footprint / spacing)
    if reach < 1 or 2 * reach >= min(heights.shape):
        raise ValueError(
            f"footprint: got {footprint:g} m, should be at least the map's spacing of "
            f"{spacing:g} m and less than half of its width"
        )
    span = np.arange(-reach, reach + 1)
    disc = [(i, j) for i in span for j in span if np.hypot(i, j) * spacing <= footprint]
    inner = tuple(length - 2 * reach for length in heights.shape)
    parts = [
        heights[reach + i : reach + i + inner[0], reach + j : reach + j + inner[1]] for i, j in disc
    ]
    square = spacing**2 * sum(i * i for i, _ in disc)
    mean = sum(parts) / len(disc)
    along_y, along_x = (
        spacing * sum(place[axis] * part for place, part in zip(disc, parts, strict=True)) / square
        for axis in (0, 1)
    )
    rough = np.zeros(inner)
    for (i, j), part in zip(disc, parts, strict=True):
        plane = mean + spacing * (i * along_y + j * along_x)
        rough = np.maximum(rough, np.abs(part - plane))
    slope = np.arctan(np.hypot(along_x, along_y))
    edge = partial(np.pad, pad_width=reach, constant_values=np.inf)
    return edge(slope), edge(rough)


def nearest_safe(
    heights: Array,
    spacing: float,
    planned: Array,
    *,
    reach: float,
    footprint: float,
    slope_limit: float,
    roughness_limit: float,
) -> Sites:
    """Return the planned site and the nearest safe one within ``reach`` [m] of it.

    The map is as in ``slope_and_roughness``, with its middle at x = y = 0; ``planned`` (2,) [m] is
    moved to the nearest of its points. A ``reach`` of zero takes that point as it is. Slopes are in
    rad, ``roughness_limit`` in m.

    Raises:
        ValueError: the planned site is not on the map, or nothing within reach is safe.
    """
    rows, columns = (spacing * (np.arange(n) - 0.5 * (n - 1)) for n in heights.shape)
    x, y = np.meshgrid(columns, rows)
    away = np.hypot(x - planned[0], y - planned[1])
    at = np.unravel_index(np.argmin(away), away.shape)
    if away[at] > spacing:
        raise ValueError(f"planned: {planned} m is not on the map")
    here = np.array([x[at], y[at], heights[at]])
    if not reach:
        return Sites(here, here)
    slope, roughness = slope_and_roughness(heights, spacing, footprint)
    fit = (slope <= slope_limit) & (roughness <= roughness_limit)
    distance = np.where(fit, np.hypot(x - here[0], y - here[1]), np.inf)
    best = np.unravel_index(np.argmin(distance), distance.shape)
    if distance[best] > reach:
        beyond = f"the nearest that does is {distance[best]:.4g} m away"
        none = "none on the map does"
        raise ValueError(
            f"reach: no site within {reach:g} m of {planned} m keeps the limits; "
            f"{none if np.isinf(distance[best]) else beyond}"
        )
    return Sites(here, np.array([x[best], y[best], heights[best]]))
