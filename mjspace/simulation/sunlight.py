"""The Sun as a vehicle sees it: its direction, the part of it that is visible, and eclipses."""

from typing import NamedTuple

from mjspace.contract import Array
from mjspace.scenario.scenario import EventTable
from mjspace.sensors import sky
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


def sunlight_at(motion: Motion) -> Sunlight | None:
    """Return what is seen of the Sun at ``motion``; None where it is not known."""
    if motion.surroundings.sun_position is None:
        return None
    return Sunlight(sky.sun_direction(motion), sky.sunlight(motion))
