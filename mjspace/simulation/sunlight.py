"""The Sun as a vehicle sees it: its direction, the part of it that is visible, and eclipses."""

from typing import Any, NamedTuple

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.shadow import visible_at
from mjspace.environment.solar_pressure import shadow_radii
from mjspace.scenario.environment import Environment
from mjspace.scenario.scenario import EventTable
from mjspace.sensors.base import Motion

_ROUNDING = 1e-9
ECLIPSES = (
    EventTable(name="in sunlight", signal="truth.sunlight", above=1.0 - _ROUNDING),
    EventTable(
        name="in the penumbra", signal="truth.sunlight", above=_ROUNDING, below=1.0 - _ROUNDING
    ),
    EventTable(name="in the umbra", signal="truth.sunlight", below=_ROUNDING),
)
"""What the log mentions of each vehicle that is in orbit around the Earth at a known epoch."""


class Sunlight(NamedTuple):
    """What is seen of the Sun."""

    sun_direction: Array
    """Unit vector from the bus, body axes, (..., 3)."""
    sunlight: Array
    """Part of its disc that the Earth's shadow leaves visible, 0 to 1, (..., 1)."""


def sunlight_at(motion: Motion, environment: Environment) -> Sunlight | None:
    """Return what is seen of the Sun at ``motion``; None where it is not known."""
    around: Any = motion.surroundings
    if around.sun_position is None:
        return None
    place = around.orbit_position(motion.time) + motion.position
    sun = around.sun_position(motion.time)
    sight = sun - place
    sight /= np.sqrt(np.sum(sight**2, axis=-1, keepdims=True))
    rows = (np.ascontiguousarray(vectors.reshape(-1, 3)) for vectors in (place, sun))
    part = visible_at(*rows, *shadow_radii(environment)).reshape(*place.shape[:-1], 1)
    return Sunlight(attitude.rotate(attitude.conjugate(motion.attitude), sight), part)
