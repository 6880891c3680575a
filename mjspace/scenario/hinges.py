"""The tables of what turns on a bearing in a scenario: friction, imbalance and stops of hinges."""

import math
from typing import Annotated, NamedTuple, Self

from pydantic import model_validator

from mjspace.scenario.fields import Angle, NonNegative, Positive, Si, Table


class Friction(NamedTuple):
    """Dry friction of one hinge: c and, at rest, the breakaway torque b with Stribeck's speed v.

    T = -(c + (b - c) exp(-(w/v)^2)) tanh(w/smoothing speed) [N m] at a relative speed w: H. Olsson,
    K. J. Astrom, C. Canudas de Wit, M. Gafvert, P. Lischinsky, "Friction models and friction
    compensation", European Journal of Control 4 (1998), section 2; the exponent 2 is that of
    B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, "A survey of models, analysis tools and
    compensation methods for the control of machines with friction", Automatica 30 (1994). The
    smoothing is ours: a rotor that a torque below b pushes does not stand, it creeps.
    """

    coulomb: float
    """c [N m]."""
    breakaway: float | None = None
    """b [N m]; that of Coulomb where None."""
    stribeck_speed: float | None = None
    """v [rad/s]; where there is a ``breakaway``."""

    @property
    def steepest(self) -> float:
        """Largest torque [N m]; over the smoothing it is the slope through zero."""
        return self.coulomb if self.breakaway is None else self.breakaway


class Bearing(Table):
    """What a bearing does to its rotor, and the rotor to its bearing."""

    viscous_friction: Annotated[NonNegative, Si("N m s/rad")] = 0.0
    """Bearing torque for each rad/s."""
    coulomb_friction: Annotated[NonNegative, Si("N m")] = 0.0
    """Dry bearing torque c at any speed, smoothed through zero: c tanh(speed / 0.1 rad/s). Where a
    step would take more than 2 J/c x 0.1 rad/s, J the inertia at the hinge, it is smoothed over as
    wide a speed as brings the rotor to rest."""
    breakaway_friction: Annotated[NonNegative, Si("N m")] | None = None
    """Dry bearing torque at the lowest speeds, falling to that of Coulomb as exp(-(speed / v)^2);
    none when left out. Goes with ``stribeck_speed``."""
    stribeck_speed: Annotated[Positive, Si("rad/s")] | None = None
    """v, over which breakaway friction falls; friction is then smoothed over a thirtieth of it."""
    static_imbalance: Annotated[NonNegative, Si("kg m")] = 0.0
    """Rotor mass times its centre's offset from the spin axis."""
    dynamic_imbalance: Annotated[NonNegative, Si("kg m^2")] = 0.0
    """Product of inertia between the spin axis and a transverse one."""

    @property
    def friction(self) -> Friction | None:
        """Dry friction; None where there is none."""
        if not (self.coulomb_friction or self.breakaway_friction):
            return None
        return Friction(self.coulomb_friction, self.breakaway_friction, self.stribeck_speed)

    @model_validator(mode="after")
    def _breakaway(self) -> Self:
        if (self.breakaway_friction is None) != (self.stribeck_speed is None):
            raise ValueError("breakaway_friction and stribeck_speed: give both or neither")
        if (self.breakaway_friction or math.inf) < self.coulomb_friction:
            raise ValueError(
                f"breakaway_friction {self.breakaway_friction:g} N m is below coulomb_friction "
                f"{self.coulomb_friction:g} N m: it is the larger one"
            )
        return self


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
