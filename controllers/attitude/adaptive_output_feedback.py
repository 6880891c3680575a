"""Adaptive attitude tracking without a rate measurement, with unknown inertia and momentum.

Paper 002 leaves this for later. The rate w = H0^-1 (R^T hI - h) is linear in 24 constants: the six
numbers a of H0^-1 and their products with the three components of the total momentum hI. What they
multiply is measured, R and, by the tachometers, h = sum a Jw Omega: w = Phi Theta. With
eps = conj(q_o) q of the shorter turn, q_o the observed attitude, and w_o = Phi Theta_o:

    q_o' = q_o [0, w_o + l1 eps_v] / 2,    Theta_o' = l2 Phi^T eps_v.

V = 2 (1 - eps_0) + |Theta_o - Theta|^2 / (2 l2) has V' = -l1 |eps_v|^2, so that w_o - w vanishes
under any control that leaves the motion bounded, and without any excitation: Phi Phi^T >= 1.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import times, transpose
from mjspace.attitude import conjugate, from_rotation_vector, multiply, to_matrix
from mjspace.contract import Array, Measurement, Reference, TorqueCommand, gain

from .adaptive_tracking import GradientGains
from .immersion_invariance_nonsingular import manifold
from .inertia_regressor import inertia_columns
from .tracking_error import shorter, tracking_error


class State(NamedTuple):
    """Memory of the law."""

    theta_hat: Array
    """Estimates of m11 m12 m13 m22 m23 m33 [kg m^2] and of the momentum hI [N m s], (..., 9)."""
    attitude: Array
    """Observed quaternion q_o, body to inertial, (..., 4)."""
    Theta: Array
    """Theta_o [rad/s], the first six times h0, (..., 24)."""


class Signals(NamedTuple):
    """Signals of the law."""

    s: Array
    """w_o - w_r [rad/s], body axes, (..., 3)."""
    theta_hat: Array
    """The estimates in use, (..., 9)."""
    estimated_rate: Array
    """w_o [rad/s], body axes, (..., 3)."""


@dataclass(frozen=True, kw_only=True)
class OutputFeedback(GradientGains):
    """The passivity-based law of ``adaptive_tracking`` at the observed rate.

    The rate's convergence is proved, that of the whole is not: it would need the integral of
    |w_o - w| to be finite. A torque turns the wheels, and through h and the estimate of H0^-1 the
    observed rate at once. Where that estimate is wrong and fast the loop is unstable: it is divided
    by h0, which makes it slow. ``measurement.rate`` is not read.
    """

    batched: ClassVar[bool] = True

    wheel_axes: Array = gain(shape=("wheel", 3), form="unit vector")
    """Unit spin axes, body axes, one row for each wheel."""
    wheel_inertia: Array = gain("kg m^2", ("wheel",), at_least=0.0)
    """Axial inertia of each wheel."""
    attitude_injection: float = gain("1/s", default=60.0, above=0.0)
    """l1."""
    rate_injection: float = gain("1/s^2", default=2000.0, above=0.0)
    """l2: small errors of the rate have poles s^2 + l1 s / 2 + l2 Phi Phi^T / 2 = 0."""

    momentum_scale: float = gain("N m s", default=30.0, above=0.0)
    """h0: a multiple of the wheels' largest momentum."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the initial state: estimates of zero, an observed rate of zero."""
        lead = measurement.attitude.shape[:-1]
        return State(np.zeros((*lead, 9)), measurement.attitude.copy(), np.zeros((*lead, 24)))

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, Signals]:
        """Return the next state, the torque, the error and the estimates."""
        q, T = measurement.attitude, self.control_period
        Phi = self._regressor(measurement)
        w = times(Phi, state.Theta)
        z, kept = manifold(tracking_error(q, w, reference), self.attitude_gain)
        theta_hat, torque = self.adapted(state.theta_hat, q, z, w - z, kept)

        eps = shorter(multiply(conjugate(state.attitude), q))[..., 1:]
        turn = T * (w + self.attitude_injection * eps)
        change = T * self.rate_injection * times(transpose(Phi), eps)
        after = State(
            theta_hat,
            multiply(state.attitude, from_rotation_vector(turn)),
            state.Theta + change,
        )
        command = TorqueCommand(torque - self.rate_gain * z)
        return after, command, Signals(z, state.theta_hat, w)

    def _regressor(self, measurement: Measurement) -> Array:
        """Return Phi, (..., 3, 24): W6(-h), and W6 of each inertial axis in body axes."""
        h = times(transpose(self.wheel_axes), self.wheel_inertia * measurement.wheel_speed)
        axes = to_matrix(measurement.attitude)
        blocks = [
            inertia_columns(-h / self.momentum_scale),
            *(inertia_columns(axes[..., k, :]) for k in range(3)),
        ]
        return np.concatenate(blocks, axis=-1)
