"""Tachometers: the speeds of the wheels."""

from typing import Annotated, ClassVar, Literal

from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.linear import Linear


class Tachometer(Linear[Annotated[NonNegative, Si("rad/s")]]):
    """Tachometers: the speed of each wheel relative to what carries it."""

    measures: Literal["wheel_speed"] = "wheel_speed"
    unit: ClassVar[str] = "rad/s"
    width: ClassVar[int | None] = None
