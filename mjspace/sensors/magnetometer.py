"""Magnetometers: the Earth's field."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from mjspace import algebra, attitude
from mjspace.contract import Array
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import Finite, NonNegative, Si
from mjspace.sensors.base import Motion
from mjspace.sensors.linear import Triad


class Magnetometer(Triad[Annotated[NonNegative, Si("T")]]):
    """Magnetometer: the Earth's field in body axes, and what the vehicle's own coils add to it.

    At a control instant the coils still have the moment of the period before it.
    """

    measures: Literal["magnetic_field"] = "magnetic_field"
    unit: ClassVar[str] = "T"

    coil_coupling: Annotated[
        list[Annotated[list[Finite], Field(min_length=3, max_length=3)]],
        Field(min_length=3, max_length=3),
        Si("T/(A m^2)"),
    ] = Field(default=[[0.0] * 3] * 3)
    """Field at the magnetometer for each unit of the coils' magnetic moment, both in body axes: row
    by row."""

    def check_environment(self, environment: Environment) -> None:
        """Refuse an environment without a magnetic field."""
        if environment.magnetic_field is None:
            raise ValueError("needs an [environment.magnetic_field]")

    def quantity(self, name: str) -> str:
        """Return the Earth's field; that at its own place where coils disturb it."""
        return f"{name}_with_coils" if np.any(self.coil_coupling) else self.measures

    def true_value(self, motion: Motion) -> Array:
        """Return the field [T], body axes, (..., 3); (..., 0) where the Earth has none."""
        field = motion.surroundings.magnetic_field
        if field is None:
            return motion.time[..., None][..., :0]
        earth = attitude.rotate(attitude.conjugate(motion.attitude), field(motion.time))
        if motion.dipole is None or not np.any(self.coil_coupling):
            return earth
        own: Array = earth + algebra.times(np.array(self.coil_coupling), motion.dipole)
        return own
