"""Sun sensors: the direction of the Sun (fine), or the currents of cells in its light (coarse)."""

from math import cos, pi
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from mjspace import attitude
from mjspace.contract import Array
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import NonNegative, Positive, Si, Unit3
from mjspace.sensors import sky
from mjspace.sensors.base import Motion, Sensor, Surroundings
from mjspace.sensors.linear import Linear

_HALF_DISC = 0.5


class SunSensor(Sensor[Annotated[NonNegative, Si("rad")]]):
    """Fine Sun sensor: the unit vector from the bus to the Sun, body axes.

    Its errors are small rotations of that vector about the body axes. While the Sun is out of its
    field of view, or more than half of the disc is in the Earth's shadow, it reports its last
    vector again, which is not valid: ``measurement.<name>_valid``. Sunlight from the Earth is left
    out.
    """

    measures: Literal["sun_direction"] = "sun_direction"
    quantization: Annotated[NonNegative, Field(lt=1), Si("rad")] = 0.0
    """Size of the least significant digit of each component."""
    boresight: Unit3 = Field(default=[0.0, 0.0, 1.0])
    """Centre of the field of view, body axes; its length does not matter."""
    field_of_view: Annotated[Positive, Field(le=pi), Si("rad")] = pi
    """Largest angle between the boresight and the Sun; all directions when left out."""
    unit: ClassVar[str] = ""

    @property
    def always_valid(self) -> bool:
        """Never: there are eclipses."""
        return False

    def check_environment(self, environment: Environment) -> None:
        """Refuse a flight in which it is not known where the Sun is."""
        refuse_without_sun(environment)

    def true_value(self, motion: Motion) -> Array:
        """Return the unit vector to the Sun, body axes, (..., 3)."""
        return sky.sun_direction(motion)

    def validity(self, motion: Motion) -> Array:
        """Return 1.0 where the Sun is in view and shines, else 0.0, (..., 1)."""
        axis, direction = sky.unit(self.boresight), sky.sun_direction(motion)
        in_view = np.sum(direction * axis, axis=-1, keepdims=True) >= cos(self.field_of_view)
        valid: Array = in_view & (sky.sunlight(motion) >= _HALF_DISC)
        return valid.astype(float)

    def with_error(self, value: Array, error: Array) -> Array:
        """Return the vector turned by the rotation vector ``error`` [rad]."""
        turned = attitude.rotate(attitude.from_rotation_vector(error), value)
        if not self.quantization:
            return turned
        digits = np.rint(turned / self.quantization)
        rounded: Array = digits / np.sqrt(np.sum(digits**2, axis=-1, keepdims=True))
        return rounded


class CoarseSunSensor(Linear[Annotated[NonNegative, Si("")]]):
    """Coarse Sun sensors: the current of each cell, 1 where the Sun is along its normal.

    A cell has the cosine of the angle to the Sun times the visible part of the Sun's disc, and none
    beyond its field of view. The Earth's albedo, which real cells see too, is left out.
    """

    measures: Literal["sun_cosines"] = "sun_cosines"
    normals: Annotated[list[Unit3], Field(min_length=1)] = Field(
        default=[[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    )
    """Of the cells, body axes, one row for each; normalized."""
    field_of_view: Annotated[Positive, Field(le=pi / 2), Si("rad")] = pi / 2
    """Largest angle between a cell's normal and the Sun."""
    unit: ClassVar[str] = ""

    def quantity(self, name: str) -> str:
        """Return the sensor's own name: the cells are its own."""
        return name

    def axes_of(self, name: str, surroundings: Surroundings) -> int:
        """Return how many cells there are."""
        return len(self.normals)

    def width_of(self, name: str, surroundings: Surroundings) -> int:
        """Return how many cells there are."""
        return len(self.normals)

    def check_environment(self, environment: Environment) -> None:
        """Refuse a flight in which it is not known where the Sun is."""
        refuse_without_sun(environment)

    def true_value(self, motion: Motion) -> Array:
        """Return the current of each cell, (..., n)."""
        direction = sky.sun_direction(motion)
        cosines = [np.sum(direction * sky.unit(n), axis=-1, keepdims=True) for n in self.normals]
        cosine = np.concatenate(cosines, axis=-1)
        lit = np.where(cosine >= max(cos(self.field_of_view), 0.0), cosine, 0.0)
        current: Array = lit * sky.sunlight(motion)
        return current


def refuse_without_sun(environment: Environment) -> None:
    """Refuse a flight in which it is not known where the Sun is.

    Raises:
        ValueError: it has no epoch, or no orbit around the Earth.
    """
    if not environment.has_sun:
        raise ValueError(
            'needs an environment.epoch and an [environment.orbit] with body = "earth"'
        )
