"""Earth horizon sensors: the direction of the Earth's centre."""

from math import cos, pi
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from mjspace import attitude
from mjspace.contract import Array
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import NonNegative, Positive, Si, Unit3
from mjspace.sensors import sky
from mjspace.sensors.base import Motion, Sensor


class HorizonSensor(Sensor[Annotated[NonNegative, Si("rad")]]):
    """Earth horizon sensor: the unit vector from the bus to the Earth's centre, body axes.

    It bisects the infrared limb of a spherical Earth (Wertz, ed., Spacecraft Attitude Determination
    and Control, 1978, section 6.2). Its errors are small rotations of that vector about the body
    axes. While the Earth's centre is out of its field of view it reports zeros, which are not
    valid.
    """

    measures: Literal["nadir"] = "nadir"
    quantization: Annotated[NonNegative, Field(lt=1), Si("rad")] = 0.0
    """Size of the least significant digit of each component."""
    boresight: Unit3 = Field(default=[0.0, 0.0, 1.0])
    """Centre of the field of view, body axes; its length does not matter."""
    field_of_view: Annotated[Positive, Field(le=pi), Si("rad")] = pi
    """Largest angle between the boresight and the Earth's centre; all directions when left out."""
    unit: ClassVar[str] = ""
    holds: ClassVar[bool] = False

    @property
    def errs(self) -> bool:
        """Whether a sample may differ from the true direction."""
        return super().errs or not self.always_valid

    @property
    def always_valid(self) -> bool:
        """Whether it looks in all directions."""
        return self.field_of_view == pi

    def check_environment(self, environment: Environment) -> None:
        """Refuse a flight that is not in an orbit round the Earth."""
        if environment.orbit is None or environment.orbit.body != "earth":
            raise ValueError('needs an [environment.orbit] with body = "earth"')

    def true_value(self, motion: Motion) -> Array:
        """Return the unit vector to the Earth's centre, body axes, (..., 3)."""
        return sky.nadir(motion)

    def validity(self, motion: Motion) -> Array:
        """Return 1.0 where the Earth's centre is in view, else 0.0, (..., 1)."""
        return self._in_view(sky.nadir(motion)).astype(float)

    def with_error(self, value: Array, error: Array) -> Array:
        """Return the vector turned by the rotation vector ``error`` [rad]; zeros out of view."""
        turned = attitude.rotate(attitude.from_rotation_vector(error), value)
        if self.quantization:
            turned = np.rint(turned / self.quantization)
            turned = turned / np.linalg.norm(turned, axis=-1, keepdims=True)
        return np.where(self._in_view(value), turned, 0.0)

    def _in_view(self, direction: Array) -> Array:
        axis = sky.unit(self.boresight)
        inside: Array = np.sum(direction * axis, axis=-1, keepdims=True) >= cos(self.field_of_view)
        return inside
