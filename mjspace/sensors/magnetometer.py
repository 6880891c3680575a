"""Magnetometers: the Earth's field."""

from typing import Annotated, ClassVar, Literal

from mjspace import attitude
from mjspace.contract import Array
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors.base import Motion, Sensor


class Magnetometer(Sensor[Annotated[NonNegative, Si("T")]]):
    """Magnetometer: the Earth's field in body axes, undisturbed by the magnetorquers."""

    measures: Literal["magnetic_field"] = "magnetic_field"
    unit: ClassVar[str] = "T"

    def check_environment(self, environment: Environment) -> None:
        """Refuse an environment without a magnetic field."""
        if environment.magnetic_field is None:
            raise ValueError("needs an [environment.magnetic_field]")

    def true_value(self, motion: Motion) -> Array:
        """Return the field [T], body axes, (..., 3); (..., 0) where the Earth has none."""
        field = motion.surroundings.magnetic_field
        if field is None:
            return motion.time[..., None][..., :0]
        return attitude.rotate(attitude.conjugate(motion.attitude), field(motion.time))
