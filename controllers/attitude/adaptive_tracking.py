"""Adaptive attitude tracking with the gradient of the tracking error: two laws that 002 builds on.

With a desired rate w_r and s = w - w_r, tau = Y theta_hat - D s and theta_hat' = -ga Y^T s, where
Y theta = H w_r' - p x w_r, (2.40) of paper 002. V = s^T H s / 2 + |theta_hat - theta|^2 / (2 ga)
then has V' = -s^T D s, so that s vanishes and the estimates stay bounded; they need not converge.
The laws differ in w_r and D. The estimate of hI assumes a constant total momentum. Integrated by
explicit Euler at the control period.
"""

from dataclasses import dataclass
from math import pi
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import times, transpose
from mjspace.attitude import to_euler_zyx
from mjspace.contract import Array, Gains, Measurement, Reference, TorqueCommand, gain

from .euler_kinematics import angle_rates, body_rate, drift, torque_of
from .immersion_invariance_nonsingular import manifold
from .inertia_regressor import momentum_columns, regressor
from .tracking_error import tracking_error


class State(NamedTuple):
    """Memory of these laws."""

    theta_hat: Array
    """Estimates of m11 m12 m13 m22 m23 m33 [kg m^2] and of the momentum hI [N m s], (..., 9)."""


class Signals(NamedTuple):
    """Signals of these laws."""

    s: Array
    """w - w_r [rad/s], body axes, (..., 3)."""
    theta_hat: Array
    """The estimates in use, (..., 9)."""


@dataclass(frozen=True, kw_only=True)
class GradientGains(Gains):
    """Gains and adaptation of laws with the gradient of the tracking error."""

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    rate_gain: float = gain("N m s/rad", default=25.0, above=0.0)
    """Kd, the same on each axis."""
    attitude_gain: float = gain("1/s", default=25.0, above=0.0)
    """Lambda: with s = 0, the attitude error vanishes at this rate."""
    adaptation_gain: float = gain(default=1.0, above=0.0)
    """ga."""

    def adapted(
        self, theta_hat: Array, q: Array, s: Array, w_r: Array, dw_r: Array
    ) -> tuple[Array, Array]:
        """Return the next estimates, (..., 9), and Y theta_hat [N m], (..., 3)."""
        Y = regressor(dw_r, momentum_columns(w_r, q))
        dtheta = -self.adaptation_gain * times(transpose(Y), s)
        return theta_hat + self.control_period * dtheta, times(Y, theta_hat)


class _WithRate(GradientGains):
    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the initial state: estimates of zero."""
        return State(np.zeros((*measurement.rate.shape[:-1], 9)))


@dataclass(frozen=True, kw_only=True)
class Passivity(_WithRate):
    """In quaternions: w_r = R_e^T wd - 2 Lambda q_v, q_v of the error's shorter turn, D = Kd.

    J.-J. Slotine, W. Li, "On the adaptive control of robot manipulators", International Journal of
    Robotics Research 6(3), 1987, on the attitude: O. Egeland, J.-M. Godhavn, "Passivity-based
    adaptive attitude control of a rigid spacecraft", IEEE Transactions on Automatic Control 39(4),
    1994. No attitude is singular; at an error of 180 deg the shorter turn changes its side.
    """

    batched: ClassVar[bool] = True

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, Signals]:
        """Return the next state, the torque, the error and the estimates."""
        q, w = measurement.attitude, measurement.rate
        s, kept = manifold(tracking_error(q, w, reference), self.attitude_gain)
        after, torque = self.adapted(state.theta_hat, q, s, w - s, kept)
        command = TorqueCommand(torque - self.rate_gain * s)
        return State(after), command, Signals(s, state.theta_hat)


@dataclass(frozen=True, kw_only=True)
class Hamiltonian(_WithRate):
    """In roll, pitch and yaw x: x_r' = x_d' + Lambda (x_d - x), w_r = J^-1 x_r', D = J^T Kd J.

    J.-J. Slotine, M. D. Di Benedetto, "Hamiltonian adaptive control of spacecraft", IEEE
    Transactions on Automatic Control 35(7), 1990: the law F = D x_r'' + C x_r' - Kd (x' - x_r') of
    robots in the coordinates of the attitude, tau = J^T F; D and C are those of paper 000, (3). It
    is local: a pitch of +-90 deg is singular, and the damping grows towards it.
    """

    batched: ClassVar[bool] = True

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, Signals]:
        """Return the next state, the torque, the error and the estimates."""
        w = measurement.rate
        x, xd = to_euler_zyx(measurement.attitude), to_euler_zyx(reference.attitude)
        dx, dxd = angle_rates(x, w), angle_rates(xd, reference.rate)
        ddxd = angle_rates(xd, reference.acceleration - drift(xd, dxd, dxd))
        error = xd - x
        error = error - 2.0 * pi * np.rint(error / (2.0 * pi))
        dx_r = dxd + self.attitude_gain * error
        ddx_r = ddxd + self.attitude_gain * (dxd - dx)
        w_r, dw_r = body_rate(x, dx_r), body_rate(x, ddx_r) + drift(x, dx, dx_r)
        s = w - w_r
        after, torque = self.adapted(state.theta_hat, measurement.attitude, s, w_r, dw_r)
        damping = self.rate_gain * torque_of(x, dx - dx_r)
        return State(after), TorqueCommand(torque - damping), Signals(s, state.theta_hat)
