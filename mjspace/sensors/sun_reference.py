"""Where the Sun is by the on-board almanac, which a Sun sensor's report is compared with."""

from typing import Annotated, ClassVar, Literal

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Motion, Sensor


class SunReference(Sensor[Annotated[NonNegative, Si("rad")]]):
    """On-board almanac of the Sun: the unit vector from the bus to the Sun, inertial axes.

    In the Earth's shadow too. Its errors, those of almanac and clock, are small rotations.
    """

    measures: Literal["sun_reference"] = "sun_reference"
    unit: ClassVar[str] = ""

    def check_environment(self, environment: Environment) -> None:
        """Refuse an environment in which nobody knows where the Sun is."""
        if not environment.has_sun:
            raise ValueError('needs environment.epoch and an [environment.orbit], body = "earth"')

    def true_value(self, motion: Motion) -> Array:
        """Return the unit vector to the Sun, inertial axes, (..., 3)."""
        return to_sun(motion)[1]

    def with_error(self, value: Array, error: Array) -> Array:
        """Return the vector turned by the rotation vector ``error`` [rad], then rounded."""
        turned = attitude.rotate(attitude.from_rotation_vector(error), value)
        return super().with_error(turned, np.zeros_like(error))


def to_sun(motion: Motion) -> tuple[Array, Array]:
    """Return the bus's place from the Earth's centre [m] and the unit vector to the Sun, inertial.

    Both (..., 3); the second without the 0.0057 deg of aberration.
    """
    around = motion.surroundings
    assert around.orbit_position is not None
    assert around.sun_position is not None
    place = around.orbit_position(motion.time) + motion.position
    return place, attitude.normalize(around.sun_position(motion.time) - place)
