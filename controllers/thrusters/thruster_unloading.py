"""Unloading of reaction wheels by thrusters while the wheels control the attitude."""

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, Reference, Unit, gain

from ..attitude.linear_quadratic import Regulator, Signals


class Command(NamedTuple):
    """Command to wheels and thrusters."""

    torque: Annotated[Array, Unit("N m")]
    """Torque of the wheels on the bus, body axes [N m], (..., 3)."""
    thruster_torque: Annotated[Array, Unit("N m")]
    """Torque of the thrusters on the bus, body axes [N m], (..., 3)."""


@dataclass(frozen=True)
class ThrusterUnloading(Regulator):
    """Thrusters give M = -kd h, which is fed forward to the wheels: h = h0 exp(-kd t).

    h is what the wheels have above the desired momentum, zero by default.
    R. Vazquez, Control activo de la actitud, Univ. Sevilla 2016. The feedforward keeps the attitude
    undisturbed; without it the attitude error is M/ka. M is held for a period T, so that kd is
    replaced by (1 - exp(-kd T))/T: then h equals the closed form at the end of every period.
    """

    unloading_gain: float = gain("1/s", default=0.005, at_least=0.0)
    """kd."""
    control_period: float = gain("s", default=0.1, above=0.0)
    """T; default: the scenario's."""
    feed_forward: float = gain(default=1.0, at_least=0.0, at_most=1.0)
    """Share of the thrusters' torque that is fed forward to the wheels; 0 shows the error M/ka."""
    desired_momentum: Array = gain("N m s", (3,), default=(0.0, 0.0, 0.0))
    """To which the wheels are unloaded, body axes: a bias that keeps them away from zero speed."""

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, Any, Signals]:
        """Return the regulator's state and signals, and the torques of wheels and thrusters."""
        state, wheels, signals = super().step(state, time, measurement, reference)
        decay = -np.expm1(-self.unloading_gain * self.control_period) / self.control_period
        thrusters = -decay * (signals.h - self.desired_momentum)
        return state, Command(wheels.torque - self.feed_forward * thrusters, thrusters), signals
