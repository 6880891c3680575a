"""Where a vehicle in orbit is above the Earth, and where it sees the Moon."""

from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import Array
from mjspace.environment.earth_rotation import geodetic
from mjspace.scenario.environment import Environment
from mjspace.sensors import sky
from mjspace.sensors.base import Motion


class Whereabouts(NamedTuple):
    """What an epoch tells of a vehicle around the Earth; arrays are (..., k)."""

    moon_direction: Array
    """Unit vector from the bus, body axes, (..., 3)."""
    latitude: Array
    """Geodetic, on WGS 84 [rad], (..., 1)."""
    longitude: Array
    """East of Greenwich [rad], (..., 1)."""
    height: Array
    """Above the ellipsoid of WGS 84 [m], (..., 1)."""


def whereabouts_at(motion: Motion, environment: Environment) -> Whereabouts | None:
    """Return where a vehicle at ``motion`` is; None where that is not known."""
    around: Any = motion.surroundings
    if around.moon_position is None or environment.time_zero is None:
        return None
    longitude, latitude, height = geodetic(environment.time_zero, sky.place(motion), motion.time)
    return Whereabouts(
        sky.moon_direction(motion),
        *(np.asarray(x)[..., None] for x in (latitude, longitude, height)),
    )
