"""Tachometers: the speeds of the wheels."""

from typing import Annotated, ClassVar, Literal

from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Sensor


class Tachometer(Sensor[Annotated[NonNegative, Si("rad/s")]]):
    """Tachometers: the speed of each wheel relative to what carries it."""

    measures: Literal["wheel_speed"] = "wheel_speed"
    unit: ClassVar[str] = "rad/s"
    width: ClassVar[int | None] = None
