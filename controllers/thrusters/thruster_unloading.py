"""Wheels that point, unloaded by thrusters meanwhile."""

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, Reference, Unit, gain

from ..attitude.linear_quadratic import Regulator, Signals


class Command(NamedTuple):
    """What wheels and thrusters are asked for."""

    torque: Annotated[Array, Unit("N m")]
    """Of the wheels on the bus, body axes [N m], (..., 3)."""
    thruster_torque: Annotated[Array, Unit("N m")]
    """On the bus, body axes [N m], (..., 3)."""


@dataclass(frozen=True)
class ThrusterUnloading(Regulator):
    """Thrusters give M = -kd h, and the wheels are told of it: h = h0 exp(-kd t), pointing as ever.

    R. Vazquez, Control activo de la actitud, Univ. Sevilla 2016. If the wheels are not told, the
    attitude is off by M/ka. M is held for a period T, for which (1 - exp(-kd T))/T is in kd's
    place: h is then that of the closed form at every period's end.
    """

    unloading_gain: float = gain("1/s", default=0.005, at_least=0.0)
    """kd."""
    control_period: float = gain("s", default=0.1, above=0.0)
    """T; the scenario's, when left out."""
    feed_forward: float = gain(default=1.0, at_least=0.0, at_most=1.0)
    """Part of the thrusters' torque that the wheels are told of: 1 or, to see the error, 0."""

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, Any, Signals]:
        """Return the torques of wheels and thrusters."""
        state, wheels, shown = super().step(state, time, measurement, reference)
        decay = -np.expm1(-self.unloading_gain * self.control_period) / self.control_period
        brought = -decay * shown.h
        return state, Command(wheels.torque - self.feed_forward * brought, brought), shown
