"""Gyros: the bus's angular velocity."""

from typing import Annotated, ClassVar, Literal

from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.linear import Triad


class Gyro(Triad[Annotated[NonNegative, Si("rad/s")]]):
    """Gyro: the bus's angular velocity relative to inertial, body axes."""

    measures: Literal["rate"] = "rate"
    unit: ClassVar[str] = "rad/s"
