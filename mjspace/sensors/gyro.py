"""Gyros: the bus's angular velocity."""

from typing import Annotated, ClassVar, Literal

from mjspace.contract import Array
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Motion, Sensor


class Gyro(Sensor[Annotated[NonNegative, Si("rad/s")]]):
    """Gyro: the bus's angular velocity relative to inertial, body axes."""

    measures: Literal["rate"] = "rate"
    unit: ClassVar[str] = "rad/s"

    def true_value(self, motion: Motion) -> Array:
        """Return the angular velocity [rad/s], body axes, (..., 3)."""
        return motion.rate
