"""The site of a landing: the planned one, and the nearest one that is free of hazards."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, NamedTuple

import numpy as np

from mjspace.contract import Array, Gains, Unit, gain

from .hazards import nearest_safe


class SiteReference(NamedTuple):
    """A ``Trajectory`` that stands at the planned site, with the safe one beside it."""

    attitude: Array
    rate: Annotated[Array, Unit("rad/s")]
    acceleration: Annotated[Array, Unit("rad/s^2")]
    position: Annotated[Array, Unit("m")]
    """The body origin on the planned site, world axes [m], (..., 3)."""
    velocity: Annotated[Array, Unit("m/s")]
    linear_acceleration: Annotated[Array, Unit("m/s^2")]
    safe_site: Annotated[Array, Unit("m")]
    """The body origin on the nearest site that is free of hazards [m], (..., 3)."""


@dataclass(frozen=True)
class LandingSite(Gains):
    """A site, and what is safe about it by a map of the ground.

    Without a map, or with no ``reach``, the planned site is taken as safe and at height zero.
    """

    planned: Array = gain("m", (2,), default=(0.0, 0.0))
    """x and y of the planned site."""
    stance: float = gain("m", default=1.8, at_least=0.0)
    """Height of the body origin above the ground when the vehicle stands."""
    ground_heights: Array = gain("m", (None, None), default=((0.0,),))
    """The map: heights, rows along y, columns along x, its middle at the origin."""
    ground_spacing: float = gain("m", default=0.0, at_least=0.0)
    """Between neighbours of the map; 0: there is no map."""
    reach: float = gain("m", default=0.0, at_least=0.0)
    """How far from the planned site the vehicle may be led."""
    footprint: float = gain("m", default=2.5, above=0.0)
    """Radius within which the ground has to be safe: the feet's, and a margin."""
    slope_limit: float = gain("rad", default=np.radians(8.0), above=0.0, below=0.5 * np.pi)
    """Of the plane fitted to the footprint."""
    roughness_limit: float = gain("m", default=0.15, above=0.0)
    """Largest distance of the ground from that plane, along z."""

    def at(self, time: Array) -> SiteReference:
        """Return the same row for each ``time`` [s]."""
        planned, safe = self._sites
        still = np.zeros((len(time), 3))
        upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(time), 1))
        return SiteReference(upright, still, still, still + planned, still, still, still + safe)

    @cached_property
    def _sites(self) -> tuple[Array, Array]:
        """The body origin on the planned site and on the safe one, each (3,)."""
        if not self.ground_spacing:
            place = np.array([*self.planned, self.stance])
            return place, place
        found = nearest_safe(
            self.ground_heights,
            self.ground_spacing,
            self.planned,
            reach=self.reach,
            footprint=self.footprint,
            slope_limit=self.slope_limit,
            roughness_limit=self.roughness_limit,
        )
        up = np.array([0.0, 0.0, self.stance])
        return found.planned + up, found.safe + up
