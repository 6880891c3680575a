"""Where the Sun is by the on-board almanac, which a Sun sensor's report is compared with."""

from typing import Annotated, ClassVar, Literal

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors import sky
from mjspace.sensors.base import Motion, Sensor
from mjspace.sensors.sun_sensor import refuse_without_sun


class SunReference(Sensor[Annotated[NonNegative, Si("rad")]]):
    """On-board almanac of the Sun: the unit vector from the bus to the Sun, inertial axes.

    In the Earth's shadow too. Its errors, those of almanac and clock, are small rotations.
    """

    measures: Literal["sun_reference"] = "sun_reference"
    unit: ClassVar[str] = ""

    def check_environment(self, environment: Environment) -> None:
        """Refuse a flight in which it is not known where the Sun is."""
        refuse_without_sun(environment)

    def true_value(self, motion: Motion) -> Array:
        """Return the unit vector to the Sun, inertial axes, (..., 3)."""
        return sky.to_sun(motion)

    def with_error(self, value: Array, error: Array) -> Array:
        """Return the vector turned by the rotation vector ``error`` [rad], then rounded."""
        turned = attitude.rotate(attitude.from_rotation_vector(error), value)
        return super().with_error(turned, np.zeros_like(error))
