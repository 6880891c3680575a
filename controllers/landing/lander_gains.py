"""Gains that the laws and the reference motions of a lunar landing share."""

from dataclasses import dataclass

import numpy as np

from mjspace.algebra import dot
from mjspace.contract import Array, Gains, gain


@dataclass(frozen=True, kw_only=True)
class LunarGravity(Gains):
    """The Moon's central gravity, for a landing plane that is tangent to the Moon."""

    gravity_parameter: float = gain("m^3/s^2", default=4.902e12, above=0.0)
    """mu of the Moon."""
    moon_radius: float = gain("m", default=1.738e6, above=0.0)
    """Distance of the landing site from the Moon's centre."""

    def gravity(self, position: Array) -> Array:
        """Return the gravity [m/s^2] at a ``position`` [m], both in world axes, (..., 3)."""
        away = position + np.array([0.0, 0.0, self.moon_radius])
        square = dot(away, away)
        gravity: Array = -self.gravity_parameter * away / (square * np.sqrt(square))
        return gravity

    def altitude(self, position: Array) -> Array:
        """Return the height above the sphere [m], (..., 1), at a ``position`` [m], (..., 3)."""
        square = dot(position, position) + 2.0 * self.moon_radius * position[..., 2:]
        found: Array = square / (self.moon_radius + np.sqrt(square + self.moon_radius**2))
        return found

    def upward(self, position: Array) -> Array:
        """Return the unit vector away from the Moon's centre, world axes, (..., 3)."""
        away = position + np.array([0.0, 0.0, self.moon_radius])
        upward: Array = away / np.sqrt(dot(away, away))
        return upward


@dataclass(frozen=True, kw_only=True)
class GimballedEngine(LunarGravity):
    """A lander with one throttled engine on two gimbals."""

    mass: float = gain("kg", default=100.0, above=0.0)
    """m: mass of the vehicle at the start."""
    thrust_range: Array = gain("N", (2,), default=(50.0, 320.0), at_least=0.0, at_most=np.inf)
    """Least and largest thrust. At zero thrust the gimbals give no torque."""
    gimbal_limit: float = gain("rad", default=np.radians(20.0), above=0.0, at_most=np.pi)
    """Largest deflection of either gimbal."""
    tank: float = gain("kg", default=0.0, at_least=0.0)
    """Propellant of all tanks at the start: m decreases with what the gauges measure as burnt. 0: m
    is constant."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (np.inf > self.thrust_range[0] <= self.thrust_range[1]):
            raise ValueError(
                f"thrust_range: got {self.thrust_range} N, should be the least, then the largest"
            )

    def limited(self, commanded: Array) -> Array:
        """Return ``commanded`` [F, b1, b2] [N, rad] within the engine's limits, (..., 3)."""
        (least, most), angle = self.thrust_range, self.gimbal_limit
        low, high = np.array([least, -angle, -angle]), np.array([most, angle, angle])
        return np.clip(commanded, low, high)

    def mass_with(self, propellant: Array) -> Array | float:
        """Return m less what is burnt, (..., 1), or m; ``propellant`` [kg] is of each tank."""
        if not self.tank or not propellant.shape[-1]:
            return self.mass
        left: Array = propellant.sum(axis=-1, keepdims=True)
        return self.mass - (self.tank - left)
