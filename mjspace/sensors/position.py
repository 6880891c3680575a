"""Position fixes, as of a receiver of navigation satellites."""

from typing import Annotated, ClassVar, Literal

from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Sensor


class PositionFix(Sensor[Annotated[NonNegative, Si("m")]]):
    """Position of the bus, inertial axes."""

    measures: Literal["position"] = "position"
    unit: ClassVar[str] = "m"
    of_translation: ClassVar[bool] = True
