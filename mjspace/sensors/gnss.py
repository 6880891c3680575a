"""Receivers of navigation satellites: position and velocity from the Earth's centre."""

from typing import Annotated, Any, ClassVar, Literal

from mjspace.contract import Array
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import NonNegative, Si
from mjspace.sensors import sky
from mjspace.sensors.base import Motion, Sensor


class GnssPosition(Sensor[Annotated[NonNegative, Si("m")]]):
    """Satellite navigation: the position of the bus from the planet's centre, inertial axes."""

    measures: Literal["gnss_position"] = "gnss_position"
    unit: ClassVar[str] = "m"

    def check_environment(self, environment: Environment) -> None:
        """Refuse a flight that is in no orbit."""
        _refuse_without_orbit(environment)

    def true_value(self, motion: Motion) -> Array:
        """Return the position [m], (..., 3)."""
        return sky.place(motion)


class GnssVelocity(Sensor[Annotated[NonNegative, Si("m/s")]]):
    """Satellite navigation: the velocity of the bus about the planet, inertial axes."""

    measures: Literal["gnss_velocity"] = "gnss_velocity"
    unit: ClassVar[str] = "m/s"

    def check_environment(self, environment: Environment) -> None:
        """Refuse a flight that is in no orbit."""
        _refuse_without_orbit(environment)

    def true_value(self, motion: Motion) -> Array:
        """Return the velocity [m/s], (..., 3)."""
        orbit: Any = motion.surroundings.orbit_velocity
        found: Array = orbit(motion.time) + motion.velocity
        return found


def _refuse_without_orbit(environment: Environment) -> None:
    if environment.orbit is None:
        raise ValueError("needs an [environment.orbit]")
