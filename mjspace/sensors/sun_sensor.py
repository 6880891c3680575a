"""Sun sensors: the direction of the Sun."""

from typing import Annotated, ClassVar, Literal

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Motion, Sensor
from mjspace.sensors.sun_reference import to_sun

_EARTH = 6378.137e3  # m


class SunSensor(Sensor[Annotated[NonNegative, Si("rad")]]):
    """Sun sensor of all directions: the unit vector from the bus to the Sun, body axes.

    Its errors are small rotations of that vector about the body axes. It reports zeros in the
    Earth's shadow, a cylinder.
    """

    measures: Literal["sun_direction"] = "sun_direction"
    unit: ClassVar[str] = ""

    def check_environment(self, environment: Environment) -> None:
        """Refuse an environment in which nobody knows where the Sun is."""
        if not environment.has_sun:
            raise ValueError('needs environment.epoch and an [environment.orbit], body = "earth"')

    def true_value(self, motion: Motion) -> Array:
        """Return the unit vector to the Sun, body axes, (..., 3); zeros in the shadow."""
        place, sun = to_sun(motion)
        ahead = np.sum(place * sun, axis=-1, keepdims=True)
        across = np.sum(place * place, axis=-1, keepdims=True) - ahead**2
        seen = attitude.rotate(attitude.conjugate(motion.attitude), sun)
        return np.where((ahead < 0.0) & (across < _EARTH**2), 0.0, seen)

    def with_error(self, value: Array, error: Array) -> Array:
        """Return the vector turned by the rotation vector ``error`` [rad], then rounded."""
        turned = attitude.rotate(attitude.from_rotation_vector(error), value)
        return super().with_error(turned, np.zeros_like(error))
