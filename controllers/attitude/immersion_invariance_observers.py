"""Immersion and invariance without a measured disturbance or without a measured rate.

Both laws are that in quaternions of ``immersion_invariance_nonsingular`` with an estimate in place
of what is not measured. Each observer's error obeys an equation in which neither the reference nor
the law appears: it vanishes under any control, and the law follows in cascade.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from mjspace.algebra import cross, times
from mjspace.contract import Array, Measurement, Reference, TorqueCommand, gain

from .immersion_invariance_nonsingular import ManifoldGains, manifold
from .rate_observer import RateObserverGains, RateState
from .tracking_error import tracking_error


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
    z' = -Gamma z - H^-1 error. Integrated by explicit Euler at the control period.
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


class RateSignals(NamedTuple):
    """Signals of the law with a rate observer."""

    sigma_e: Array
    """Attitude error, MRP, (..., 3)."""
    z: Array
    """Distance from the manifold at the estimated rate [rad/s], body axes, (..., 3)."""
    estimated_rate: Array
    """[rad/s], body axes, (..., 3)."""


@dataclass(frozen=True, kw_only=True)
class RateObserver(ManifoldGains, RateObserverGains):
    """With an estimate of the rate, from attitude and tachometers: see ``rate_observer``."""

    batched: ClassVar[bool] = True

    def reset(self, measurement: Measurement, reference: Reference) -> RateState:
        """Return the state of an estimated rate of zero, at the measured attitude."""
        return self.at_rest(measurement)

    def step(
        self, state: RateState, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[RateState, TorqueCommand, RateSignals]:
        """Return the next state, the torque, the errors and the estimate."""
        after, w, p = self.observed(state, measurement)
        error = tracking_error(measurement.attitude, w, reference)
        z, kept = manifold(error, self.target_gain)
        torque = self.torque_for(kept - self.manifold_gain * z, p, w)
        return after, TorqueCommand(torque), RateSignals(error.sigma_e, z, w)
