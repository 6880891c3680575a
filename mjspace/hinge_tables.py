"""The tables of what turns on a bearing in a scenario: friction, imbalance and stops of hinges."""

import math
from typing import Annotated, Self

from pydantic import model_validator

from mjspace.fields import Angle, NonNegative, Si, Table


class Bearing(Table):
    """What a bearing does to its rotor, and the rotor to its bearing."""

    viscous_friction: Annotated[NonNegative, Si("N m s/rad")] = 0.0
    """Bearing torque for each rad/s."""
    coulomb_friction: Annotated[NonNegative, Si("N m")] = 0.0
    """Bearing torque at any speed, smoothed through zero: c tanh(speed / 0.1 rad/s)."""
    static_imbalance: Annotated[NonNegative, Si("kg m")] = 0.0
    """Rotor mass times its centre's offset from the spin axis."""
    dynamic_imbalance: Annotated[NonNegative, Si("kg m^2")] = 0.0
    """Product of inertia between the spin axis and a transverse one."""


class Hinge(Bearing):
    """A hinge of a part: what is added to the part's own friction and mass properties."""

    lower_stop: Angle | None = None
    """Least angle; none when left out. A stop yields by 2 mrad for each rad/s that hits it."""
    upper_stop: Angle | None = None
    """Greatest angle; none when left out."""

    @property
    def stops(self) -> tuple[float, float] | None:
        """Lower and upper stop [rad], infinite where there is none on one side; or no stops."""
        if self.lower_stop is None and self.upper_stop is None:
            return None
        lower = -math.inf if self.lower_stop is None else self.lower_stop
        return lower, math.inf if self.upper_stop is None else self.upper_stop

    @model_validator(mode="after")
    def _room(self) -> Self:
        if self.stops is not None and self.stops[0] >= self.stops[1]:
            lower, upper = self.stops
            raise ValueError(f"lower_stop {lower:g} rad is not below upper_stop {upper:g} rad")
        return self
