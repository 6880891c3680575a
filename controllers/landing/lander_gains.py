"""Gains that the laws and the reference motions of a lunar landing share."""

from dataclasses import dataclass

import numpy as np

from mjspace.contract import Array, Gains, gain


@dataclass(frozen=True, kw_only=True)
class LunarGravity(Gains):
    """The Moon's central gravity, for a landing plane that is tangent to the Moon."""

    gravity_parameter: float = gain("m^3/s^2", default=4.902e12, above=0.0)
    """mu of the Moon."""
    moon_radius: float = gain("m", default=1.738e6, above=0.0)
    """Distance of the landing site from the Moon's centre."""


@dataclass(frozen=True, kw_only=True)
class GimballedEngine(LunarGravity):
    """A lander with one throttled engine on two gimbals."""

    mass: float = gain("kg", default=100.0, above=0.0)
    """m: mass of the vehicle at the start."""
    thrust_range: Array = gain("N", (2,), default=(50.0, 320.0), at_least=0.0, at_most=np.inf)
    """Least and largest thrust. At zero thrust the gimbals give no torque."""
    gimbal_limit: float = gain("rad", default=np.radians(20.0), above=0.0, at_most=np.pi)
    """Largest deflection of either gimbal."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (np.inf > self.thrust_range[0] <= self.thrust_range[1]):
            raise ValueError(
                f"thrust_range: got {self.thrust_range} N, should be the least, then the largest"
            )
