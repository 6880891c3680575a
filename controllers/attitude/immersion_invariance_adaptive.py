"""Immersion and invariance with an unknown inertia: the estimate is attracted to a manifold.

The law in quaternions of ``immersion_invariance_nonsingular`` needs H. In H (z' + Gamma z) =
tau - w x h - Y theta the inertia's six numbers theta stand linearly, but beta(x) of the immersion
and invariance estimator (Astolfi, Karagiannis, Ortega 2008, "Nonlinear and Adaptive Control with
Applications", Springer) would be an integral of Y over z, which does not exist. The regressor is
therefore filtered, as in D. Seo, M. R. Akella, "High-performance spacecraft adaptive
attitude-tracking control through attracting-manifold design", Journal of Guidance, Control, and
Dynamics 31(4), 2008.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross, cross_matrix, matrix_product, times, transpose
from mjspace.contract import Array, Gains, Measurement, Reference, TorqueCommand, gain

from .immersion_invariance_nonsingular import manifold
from .inertia_regressor import inertia_columns
from .tracking_error import tracking_error
from .wheel_momentum import wheel_momentum


class State(NamedTuple):
    """Memory of the law."""

    theta_hat: Array
    """Estimates of m11 m12 m13 m22 m23 m33 [kg m^2], (..., 6)."""
    Y_f: Array
    """Filtered regressor, (..., 3, 6)."""
    nu: Array
    """z(0) e^-Gamma t [rad/s], (..., 3)."""


class Signals(NamedTuple):
    """Signals of the law."""

    sigma_e: Array
    """Attitude error, MRP, (..., 3)."""
    z: Array
    """Distance from the manifold, w_e + 2 K q_v [rad/s], body axes, (..., 3)."""
    theta_hat: Array
    """Estimates of m11 m12 m13 m22 m23 m33 [kg m^2], (..., 6)."""


@dataclass(frozen=True)
class Adaptive(Gains):
    """tau = w x h + Y theta_hat + Y_f theta_hat', theta_hat' = -g Y_f^T (z - nu).

    With Y_f' = -Gamma Y_f + Y and nu' = -Gamma nu from nu = z(0): H (z - nu) = Y_f (theta_hat -
    theta) at all times, so the estimate's error decreases with -g Y_f^T H^-1 Y_f, never grows, and
    z = nu = z(0) e^-Gamma t where nothing is left to estimate. The wheels' momentum h comes from
    the tachometers; the law holds under any total momentum, and for no torque from outside.
    Integrated by explicit Euler at the control period.
    """

    batched: ClassVar[bool] = True

    wheel_axes: Array = gain(shape=("wheel", 3), form="unit vector")
    """Unit spin axes, body axes, one row for each wheel."""
    wheel_inertia: Array = gain("kg m^2", ("wheel",), at_least=0.0)
    """Axial inertia of each wheel."""
    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    target_gain: float = gain("1/s", default=10.0, above=0.0)
    """K: rate of the target system sigma_e' = -K sigma_e."""
    manifold_gain: float = gain("1/s", default=5.0, above=0.0)
    """Gamma: rate at which the manifold z = 0 is reached, and of the filter."""
    adaptation_gain: float = gain(default=100.0, above=0.0)
    """g."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the state of an estimate of zero."""
        error = tracking_error(measurement.attitude, measurement.rate, reference)
        z, _ = manifold(error, self.target_gain)
        lead = z.shape[:-1]
        return State(np.zeros((*lead, 6)), np.zeros((*lead, 3, 6)), z)

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, Signals]:
        """Return the next state, the torque, the errors and the estimates."""
        theta_hat, Y_f, nu = state
        Gamma, w, T = self.manifold_gain, measurement.rate, self.control_period
        error = tracking_error(measurement.attitude, w, reference)
        z, kept = manifold(error, self.target_gain)
        # Y theta = H (kept - Gamma z) + w x H w
        Y = inertia_columns(kept - Gamma * z) + matrix_product(cross_matrix(w), inertia_columns(w))
        dtheta = -self.adaptation_gain * times(transpose(Y_f), z - nu)
        torque = times(Y, theta_hat) + times(Y_f, dtheta)
        torque = torque + cross(w, wheel_momentum(self, measurement))
        after = State(theta_hat + T * dtheta, Y_f + T * (Y - Gamma * Y_f), nu - T * Gamma * nu)
        return after, TorqueCommand(torque), Signals(error.sigma_e, z, theta_hat)
