"""Position fixes, as of a receiver of navigation satellites."""

from typing import Annotated, ClassVar, Literal

from mjspace.contract import Array
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Motion, Sensor


class PositionFix(Sensor[Annotated[NonNegative, Si("m")]]):
    """Position of the bus, inertial axes."""

    measures: Literal["position"] = "position"
    unit: ClassVar[str] = "m"
    of_translation: ClassVar[bool] = True

    def true_value(self, motion: Motion) -> Array:
        """Return the position [m], inertial axes, (..., 3)."""
        return motion.position
