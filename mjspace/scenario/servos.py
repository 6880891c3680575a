"""The table of speed loops that turn gimbals, and hold the speed of the wheels in them."""

from typing import Annotated

from mjspace.scenario.fields import Finite, NonNegative, Positive, Si, Table


class Servos(Table):
    """Speed loops on every hinge of the parts that has a motor: gimbals alike, and wheels alike.

    A hinge whose name ends in ``wheel`` is a wheel, any other a gimbal. A loop is proportional and
    integral, and its motor acts against what carries the hinge.
    """

    rate_limit: Annotated[Positive, Si("rad/s")] | None = None
    """Fastest that a gimbal is told to turn; none when left out."""
    torque_limit: Annotated[Positive, Si("N m")] | None = None
    """Largest torque of a gimbal's motor; none when left out."""
    rate_gain: Annotated[Positive, Si("N m s/rad")] = 0.8
    """Torque of a gimbal's motor for each rad/s that it is slow."""
    integral_gain: Annotated[NonNegative, Si("N m/rad")] = 60.0
    """And for each rad that it is behind."""
    wheel_speed: Annotated[Finite, Si("rad/s")]
    """Held, relative to the gimbal; where a wheel starts is ``initial.wheel_speed``."""
    wheel_torque_limit: Annotated[Positive, Si("N m")] | None = None
    """Largest torque of a wheel's motor; none when left out."""
    wheel_gain: Annotated[Positive, Si("N m s/rad")] = 0.1
    """Torque of a wheel's motor for each rad/s that it is slow."""
    wheel_integral_gain: Annotated[NonNegative, Si("N m/rad")] = 0.5
    """And for each rad that it is behind."""
