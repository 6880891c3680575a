"""Velocity fixes, as of a receiver of navigation satellites."""

from typing import Annotated, ClassVar, Literal

from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Sensor


class VelocityFix(Sensor[Annotated[NonNegative, Si("m/s")]]):
    """Velocity of the bus, inertial axes."""

    measures: Literal["velocity"] = "velocity"
    unit: ClassVar[str] = "m/s"
    of_translation: ClassVar[bool] = True
