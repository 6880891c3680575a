"""Altimeters: the height above flat ground."""

from typing import Annotated, ClassVar, Literal

from mjspace.contract import Array
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Motion
from mjspace.sensors.linear import Linear


class Altimeter(Linear[Annotated[NonNegative, Si("m")]]):
    """Altimeter: the height of the bus above the plane z = 0."""

    measures: Literal["altitude"] = "altitude"
    unit: ClassVar[str] = "m"
    width: ClassVar[int | None] = 1
    of_translation: ClassVar[bool] = True

    def true_value(self, motion: Motion) -> Array:
        """Return the height [m], (..., 1)."""
        return motion.position[..., 2:]
