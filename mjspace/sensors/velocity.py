"""Velocity fixes, as of a receiver of navigation satellites."""

from typing import Annotated, ClassVar, Literal

from mjspace.contract import Array
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Motion, Sensor


class VelocityFix(Sensor[Annotated[NonNegative, Si("m/s")]]):
    """Velocity of the bus, inertial axes."""

    measures: Literal["velocity"] = "velocity"
    unit: ClassVar[str] = "m/s"
    of_translation: ClassVar[bool] = True

    def true_value(self, motion: Motion) -> Array:
        """Return the velocity [m/s], inertial axes, (..., 3)."""
        return motion.velocity
