"""A planned slew: its torques as planned, and feedback of what the vehicle departs from it."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross, times
from mjspace.contract import Array, Gains, Measurement, Reference, TorqueCommand, Unit, gain

from .turn import turn


class State(NamedTuple):
    """Memory of the law: empty."""


class Signals(NamedTuple):
    """Signals of the law."""

    angle: Annotated[Array, Unit("rad")]
    """Rotation vector from the desired to the measured attitude [rad], body axes, (..., 3)."""
    angle_rate: Annotated[Array, Unit("rad/s")]
    """Measured less desired rate [rad/s], body axes, (..., 3)."""
    feedback: Annotated[Array, Unit("N m")]
    """What feedback adds to the planned torque before the limits [N m], (..., 3)."""


@dataclass(frozen=True)
class PlannedSlew(Gains):
    """tau = H w_d' + w_d x H w_d - kp a - kd a', each axis within its own limit.

    The first two terms are the torque of the reference, as ``planned:Planned`` plans it, applied in
    the body's own axes; with both gains zero it is flown open loop. A torque at its limit leaves
    feedback one sense alone: plan with less than ``torque_limit`` to leave it the other.
    """

    batched: ClassVar[bool] = True

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """H: of the whole vehicle, about its centre of mass, body axes."""
    torque_limit: Array = gain("N m", (3,), above=0.0, at_most=np.inf)
    """Of each axis."""
    attitude_gain: float = gain("N m/rad", default=0.0, at_least=0.0)
    """kp, the same on each axis."""
    rate_gain: float = gain("N m s/rad", default=0.0, at_least=0.0)
    """kd, the same on each axis."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the empty state."""
        return State()

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, Signals]:
        """Return the torque on the bus [N m], body axes, and the errors."""
        H, w = self.inertia, reference.rate
        angle, slip = turn(measurement, reference, np.eye(3))
        planned = times(H, reference.acceleration) + cross(w, times(H, w))
        feedback = -self.attitude_gain * angle - self.rate_gain * slip
        torque = np.clip(planned + feedback, -self.torque_limit, self.torque_limit)
        return state, TorqueCommand(torque), Signals(angle, slip, feedback)
