"""Velocimeters: the velocity over the ground in body axes, as of a Doppler radar."""

from typing import Annotated, ClassVar, Literal

from mjspace import attitude
from mjspace.contract import Array
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Motion
from mjspace.sensors.linear import Triad


class Velocimeter(Triad[Annotated[NonNegative, Si("m/s")]]):
    """Velocimeter: the velocity of the bus, body axes."""

    measures: Literal["ground_velocity"] = "ground_velocity"
    unit: ClassVar[str] = "m/s"
    of_translation: ClassVar[bool] = True

    def true_value(self, motion: Motion) -> Array:
        """Return the velocity [m/s], body axes, (..., 3)."""
        return attitude.rotate(attitude.conjugate(motion.attitude), motion.velocity)
