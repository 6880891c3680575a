"""Attitude tracking by computed torque, in Euler angles, as for robot manipulators.

R. Kelly, V. Santibáñez, A. Loría, "Control of Robot Manipulators in Joint Space", Springer 2005,
chapter 10: F = D (x_d'' + Kv x_e' + Kp x_e) + C x', with D and C of paper 000, (3), and
x_e = x_d - x. The immersion and invariance law of that paper is this one with Kv = K + Gamma and
Kp = K Gamma; a pair of gains with Kv^2 < 4 Kp, which oscillates, is of no K and Gamma.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.attitude import to_euler_zyx
from mjspace.contract import Array, Measurement, Reference, TorqueCommand, gain

from .euler_kinematics import angle_rates, body_rate, drift, unwrapped
from .gyrostat import Gyrostat
from .immersion_invariance import State


class Signals(NamedTuple):
    """Signals of the law."""

    x_e: Array
    """Desired less measured angles [rad], (..., 3)."""
    dx_e: Array
    """Its derivative [rad/s], (..., 3)."""


@dataclass(frozen=True)
class ComputedTorque(Gyrostat):
    """x_e'' + Kv x_e' + Kp x_e = 0, away from a pitch of +-90 deg."""

    batched: ClassVar[bool] = True

    attitude_gain: float = gain("1/s^2", default=50.0, above=0.0)
    """Kp."""
    rate_gain: float = gain("1/s", default=15.0, above=0.0)
    """Kv."""
    unwrap_from: Array = gain("rad", (3,), default=(0.0, 0.0, 0.0))
    """The first measured angles are unwrapped to within 180 deg of these."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the initial state, the measured angles unwrapped to ``unwrap_from``."""
        angles = unwrapped(measurement.attitude, self.unwrap_from)
        desired = np.broadcast_to(to_euler_zyx(reference.attitude), angles.shape)
        return State(angles, desired.copy())

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, Signals]:
        """Return the next state, the torque and the errors."""
        w = measurement.rate
        x = unwrapped(measurement.attitude, state.angles)
        xd = unwrapped(reference.attitude, state.desired_angles)
        dx, dxd = angle_rates(x, w), angle_rates(xd, reference.rate)
        ddxd = angle_rates(xd, reference.acceleration - drift(xd, dxd, dxd))
        x_e, dx_e = xd - x, dxd - dx
        v = ddxd + self.rate_gain * dx_e + self.attitude_gain * x_e
        acceleration = body_rate(x, v) + drift(x, dx, dx)
        torque = self.torque_for(acceleration, self.total_momentum(measurement), w)
        return State(x, xd), TorqueCommand(torque), Signals(x_e, dx_e)
