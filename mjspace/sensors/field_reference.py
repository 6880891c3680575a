"""The Earth's field by the on-board model, which a magnetometer's report is compared with."""

from typing import Annotated, ClassVar, Literal

from mjspace.contract import Array
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Motion, Sensor


class FieldReference(Sensor[Annotated[NonNegative, Si("T")]]):
    """On-board model of the Earth's magnetic field at the on-board position, inertial axes.

    Its errors are those of the model, of the position and of the clock, on each axis.
    """

    measures: Literal["field_reference"] = "field_reference"
    unit: ClassVar[str] = "T"

    def check_environment(self, environment: Environment) -> None:
        """Refuse an environment without a magnetic field."""
        if environment.magnetic_field is None:
            raise ValueError("needs an [environment.magnetic_field]")

    def true_value(self, motion: Motion) -> Array:
        """Return the field [T], inertial axes, (..., 3)."""
        field = motion.surroundings.magnetic_field
        assert field is not None
        return field(motion.time)
