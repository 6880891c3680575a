"""Pointing at targets: a place on the Earth, and another spacecraft."""

from dataclasses import dataclass, field

import numpy as np

from mjspace.contract import Array, Ephemeris, ReferenceSource, Trajectory, gain

from .jets import Jet
from .pointing import Direction, Pointing, direction

EQUATOR, FLATTENING = 6378137.0, 1.0 / 298.257223563
"""m, and 1: the ellipsoid of WGS 84 (NGA.STND.0036, 2014, table 3.1)."""


def geodetic(latitude: float, longitude: float, height: float) -> Array:
    """Return the place (3,) [m], Earth-fixed axes, at a geodetic latitude and longitude [rad].

    Its ``height`` [m] is above the ellipsoid of WGS 84 (Vallado 2013, Fundamentals of Astrodynamics
    and Applications, 4th edition, section 3.2.2).
    """
    square = FLATTENING * (2.0 - FLATTENING)  # of the eccentricity
    sine, cosine = np.sin(latitude), np.cos(latitude)
    normal = EQUATOR / np.sqrt(1.0 - square * sine**2)
    level = (normal + height) * cosine
    up = (normal * (1.0 - square) + height) * sine
    return np.array([level * np.cos(longitude), level * np.sin(longitude), up])


@dataclass(frozen=True)
class GroundTarget(Pointing):
    """A body axis to a place on the Earth, whether or not it is above the horizon."""

    ephemeris: Ephemeris
    latitude: float = gain("rad", at_least=-0.5 * np.pi, at_most=0.5 * np.pi)
    """Geodetic."""
    longitude: float = gain("rad", at_least=-2.0 * np.pi, at_most=2.0 * np.pi)
    """East of Greenwich."""
    height: float = gain("m", default=0.0)
    """Above the ellipsoid of WGS 84."""
    axis: Array = gain(shape=(3,), default=(0.0, 0.0, 1.0), form="direction")
    """Body axis that points to the target."""
    second_axis: Array = gain(shape=(3,), default=(1.0, 0.0, 0.0), form="direction")
    """Body axis that is turned about the first towards ``second``."""
    second: Direction = field(default="velocity")

    def directions(self, time: Array) -> tuple[Jet, Jet]:
        """Return the directions of the target and of ``second``."""
        place = geodetic(self.latitude, self.longitude, self.height)
        target, own = self.ephemeris.fixed_to_earth(place, time), self.ephemeris.origin(time)
        sight = (a - b for a, b in zip(target[:3], own[:3], strict=True))
        return Jet(*sight), direction(self.ephemeris, self.second, time)

    @property
    def axes(self) -> tuple[Array, Array]:
        """As declared."""
        return self.axis, self.second_axis


@dataclass(frozen=True)
class SpacecraftTarget(Pointing):
    """A body axis to another spacecraft, by the motion that is planned or predicted of it.

    What it really does is known to a law alone, which measures it: the reference is a function of
    time, known beforehand.
    """

    ephemeris: Ephemeris
    target: ReferenceSource
    """Where it will be: a table with the ``kind`` of a reference with a position, in the free-fall
    frame, as ``relative_orbit:RelativeOrbit``."""
    own: ReferenceSource | None = None
    """Where the vehicle will be, likewise; at the frame's origin when left out."""
    axis: Array = gain(shape=(3,), default=(0.0, 0.0, 1.0), form="direction")
    """Body axis that points to the target."""
    second_axis: Array = gain(shape=(3,), default=(1.0, 0.0, 0.0), form="direction")
    """Body axis that is turned about the first towards ``second``."""
    second: Direction = field(default="orbit normal")

    def __post_init__(self) -> None:
        """Refuse what is no motion; ValueError for it."""
        super().__post_init__()
        for name in ("target", "own"):
            source = getattr(self, name)
            if not (hasattr(source, "at") or (name == "own" and source is None)):
                raise ValueError(
                    f"{name}: got {source!r}, should be a table with the kind of a reference that "
                    "has a position"
                )

    def directions(self, time: Array) -> tuple[Jet, Jet]:
        """Return the directions of the target and of ``second``."""
        sight = _motion("target", self.target, time)
        if self.own is not None:
            sight = sight - _motion("own", self.own, time)
        return sight, direction(self.ephemeris, self.second, time)

    @property
    def axes(self) -> tuple[Array, Array]:
        """As declared."""
        return self.axis, self.second_axis


def _motion(name: str, source: ReferenceSource, time: Array) -> Jet:
    desired = source.at(time)
    if not isinstance(desired, Trajectory):
        raise ValueError(f"{name}: {type(source).__name__} has no position")
    return Jet(desired.position, desired.velocity, desired.linear_acceleration)
