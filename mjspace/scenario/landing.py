"""The tables of a landing in a scenario: the ground and the engine."""

import math
from typing import Annotated

from pydantic import Field, model_validator

from mjspace.scenario.fields import NonNegative, Positive, Seconds, Si, Table, Time, WithinTurn


class Ground(Table):
    """What the vehicle lands on."""

    part: str = "moon_plain"
    """Name of a folder in assets/parts/ with a geom called ``ground``."""
    slope: Annotated[NonNegative, Field(lt=0.5 * math.pi), Si("rad")] = 0.0
    """How steep it is at the site."""
    downhill: WithinTurn = 0.0
    """Where the slope leads down to: from x towards y."""


class Engine(Table):
    """An engine on two gimbals, of a model that has ``engine_outer``, ``_inner`` and ``_thrust``.

    Each gimbal is turned by a position loop around a rate loop; the limit is on the rate that the
    one asks of the other.
    """

    thrust_max: Annotated[Positive, Si("N")]
    """Largest thrust."""
    thrust_min: Annotated[NonNegative, Si("N")] = 0.0
    """Least thrust while it burns; a command of zero puts it out for good."""
    thrust_lag: Time = 0.0
    """Time constant with which the thrust follows its command."""
    specific_impulse: Seconds | None = None
    """Thrust over the weight of the propellant's flow, on Earth; burns nothing when left out."""
    propellant: Annotated[Positive, Si("kg")] | None = None
    """In the tank at the start, the body ``tank``; the model's own when left out."""
    gimbal_limit: Annotated[Positive, Field(le=math.pi), Si("rad")] = 0.35
    """Largest deflection of each gimbal that is asked for."""
    gimbal_rate_limit: Annotated[Positive, Si("rad/s")] | None = None
    """Fastest rate that is asked for; none when left out."""
    gimbal_lag: Seconds = 0.05
    """Time constant of the position loop."""
    gimbal_rate_gain: Annotated[Positive, Si("N m s/rad")] = 10.0
    """Of the rate loop."""
    gimbal_torque_limit: Annotated[Positive, Si("N m")] = 10.0
    """Largest torque of each gimbal's motor, beyond which it is saturated."""
    fails_at: Seconds | None = None
    """When the engine goes out by itself; never when left out."""

    @model_validator(mode="after")
    def _throttle(self) -> "Engine":
        if self.thrust_min > self.thrust_max:
            raise ValueError(
                f"thrust_min {self.thrust_min:g} N is above thrust_max {self.thrust_max:g} N"
            )
        return self
