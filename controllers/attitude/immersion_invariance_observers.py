"""Immersion and invariance without a measured disturbance or without a measured rate.

Both laws are that in quaternions of ``immersion_invariance_nonsingular`` with an estimate in place
of what is not measured. Each observer's error obeys an equation in which neither the reference nor
the law appears: it vanishes under any control, and the law follows in cascade. Integrated by
explicit Euler at the control period.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross, times, transpose
from mjspace.attitude import conjugate, from_rotation_vector, multiply, rotate, to_matrix
from mjspace.contract import Array, Measurement, Reference, TorqueCommand, gain

from .immersion_invariance_nonsingular import ManifoldGains, manifold
from .tracking_error import shorter, tracking_error


class DisturbanceState(NamedTuple):
    """Memory of the law with a disturbance observer."""

    zeta: Array
    """The part of the estimate that is integrated [N m], (..., 3)."""


class DisturbanceSignals(NamedTuple):
    """Signals of the law with a disturbance observer."""

    sigma_e: Array
    """Attitude error, MRP, (..., 3)."""
    z: Array
    """Distance from the manifold, w_e + 2 K q_v [rad/s], body axes, (..., 3)."""
    disturbance: Array
    """Estimated, body axes [N m], (..., 3)."""


@dataclass(frozen=True, kw_only=True)
class DisturbanceObserver(ManifoldGains):
    """With an estimate of a torque d from outside that is constant in body axes.

    The estimate is zeta + beta(w), beta = L H w, as in A. Astolfi, D. Karagiannis, R. Ortega,
    "Nonlinear and Adaptive Control with Applications", Springer 2008, chapter 5. With
    zeta' = -L (p x w + tau + estimate) its error is a multiple of e^-Lt, and
    z' = -Gamma z - H^-1 error.
    """

    batched: ClassVar[bool] = True

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    observer_gain: float = gain("1/s", default=2.0, above=0.0)
    """L: rate of the estimate's error."""

    def reset(self, measurement: Measurement, reference: Reference) -> DisturbanceState:
        """Return the state of an estimate of zero."""
        return DisturbanceState(-self.observer_gain * times(self.inertia, measurement.rate))

    def step(
        self,
        state: DisturbanceState,
        time: float,
        measurement: Measurement,
        reference: Reference,
    ) -> tuple[DisturbanceState, TorqueCommand, DisturbanceSignals]:
        """Return the next state, the torque, the errors and the estimate."""
        L, w = self.observer_gain, measurement.rate
        error = tracking_error(measurement.attitude, w, reference)
        z, kept = manifold(error, self.target_gain)
        p = self.total_momentum(measurement)
        estimate = state.zeta + L * times(self.inertia, w)
        torque = self.torque_for(kept - self.manifold_gain * z, p, w) - estimate
        dzeta = -L * (cross(p, w) + torque + estimate)
        after = DisturbanceState(state.zeta + self.control_period * dzeta)
        return after, TorqueCommand(torque), DisturbanceSignals(error.sigma_e, z, estimate)


class RateState(NamedTuple):
    """Memory of the law with a rate observer."""

    attitude: Array
    """Observed quaternion, body to inertial, (..., 4)."""
    momentum: Array
    """Estimated total momentum, inertial axes [N m s], (..., 3)."""


class RateSignals(NamedTuple):
    """Signals of the law with a rate observer."""

    sigma_e: Array
    """Attitude error, MRP, (..., 3)."""
    z: Array
    """Distance from the manifold at the estimated rate [rad/s], body axes, (..., 3)."""
    estimated_rate: Array
    """[rad/s], body axes, (..., 3)."""


@dataclass(frozen=True, kw_only=True)
class RateObserver(ManifoldGains):
    """With an estimate of the rate, from the attitude and the tachometers.

    No torque acts from outside, so that the total momentum hI is constant in inertial axes and
    w = H0^-1 (R^T hI - h), with H0 the inertia with the wheels locked and h = sum a Jw Omega. With
    eps = conj(q_o) q, the error of the observed attitude q_o, of the shorter turn, and estimates
    w_o and hI_o:

        q_o' = q_o [0, w_o + l1 eps_v] / 2,    hI_o' = l2 c^2 R H0^-1 eps_v,

    where c = tr H0 / 3. V = 2 (1 - eps_0) + |hI_o - hI|^2 / (2 l2 c^2) has V' = -l1 |eps_v|^2.
    S. Salcudean, "A globally convergent angular velocity observer for rigid body motion", IEEE
    Transactions on Automatic Control 36(12), 1991, has the idea for a body without wheels.
    ``measurement.rate`` is not read.
    """

    batched: ClassVar[bool] = True

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    attitude_injection: float = gain("1/s", default=20.0, above=0.0)
    """l1."""
    momentum_injection: float = gain("1/s^2", default=100.0, above=0.0)
    """l2: small errors have poles s^2 + l1 s / 2 + l2 (c / H0)^2 / 2 = 0 about each principal axis,
    of inertia H0."""

    def reset(self, measurement: Measurement, reference: Reference) -> RateState:
        """Return the state of an estimated rate of zero, at the measured attitude."""
        q = measurement.attitude
        return RateState(q.copy(), rotate(q, self.relative_momentum(measurement)))

    def step(
        self, state: RateState, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[RateState, TorqueCommand, RateSignals]:
        """Return the next state, the torque, the errors and the estimate."""
        q, R = measurement.attitude, to_matrix(measurement.attitude)
        p = times(transpose(R), state.momentum)
        w = times(self.locked_inverse, p - self.relative_momentum(measurement))
        error = tracking_error(q, w, reference)
        z, kept = manifold(error, self.target_gain)
        torque = self.torque_for(kept - self.manifold_gain * z, p, w)

        eps = shorter(multiply(conjugate(state.attitude), q))[..., 1:]
        turn = self.control_period * (w + self.attitude_injection * eps)
        change = self._momentum_gain * times(R, times(self.locked_inverse, eps))
        after = RateState(
            multiply(state.attitude, from_rotation_vector(turn)),
            state.momentum + self.control_period * change,
        )
        return after, TorqueCommand(torque), RateSignals(error.sigma_e, z, w)

    @cached_property
    def _momentum_gain(self) -> float:
        """l2 c^2 [(kg m^2/s)^2]."""
        return self.momentum_injection * (float(np.trace(self.locked)) / 3.0) ** 2
