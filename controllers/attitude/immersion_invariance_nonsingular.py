"""Attitude tracking by immersion and invariance without a singular attitude, after paper 000.

The paper's design holds for any coordinates x of the attitude; it flies Euler angles. Here they are
of the error q_e from desired to body axes, taken as the shorter turn, with w_e the error of the
rate: sigma_e, modified Rodrigues parameters (MRP), or the quaternion itself. Both laws have the
target system sigma_e' = -K sigma_e and so the same manifold, w_e + 2 K q_v = 0, on which the
tangent of a quarter of the error angle decays at K; they differ in how it is reached.

No attitude and no reference is singular. At an error of 180 deg, and nowhere else, the shorter turn
changes from one side to the other, and the torque with it. All arrays may have leading vehicle
axes.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from mjspace.algebra import cross, dot
from mjspace.contract import Array, Measurement, Reference, TorqueCommand, gain

from .gyrostat import Gyrostat
from .tracking_error import TrackingError, tracking_error


class State(NamedTuple):
    """Memory of these laws: empty."""


class MrpSignals(NamedTuple):
    """Signals of the law in MRP."""

    sigma_e: Array
    """Attitude error, MRP, (..., 3)."""
    z: Array
    """Distance from the manifold, sigma_e' + K sigma_e [1/s], (..., 3)."""


class QuaternionSignals(NamedTuple):
    """Signals of the law in quaternions."""

    sigma_e: Array
    """Attitude error, MRP, (..., 3)."""
    z: Array
    """Distance from the manifold, w_e + 2 K q_v [rad/s], body axes, (..., 3)."""


def manifold(error: TrackingError, K: float) -> tuple[Array, Array]:
    """Return z = w_e + 2 K q_v [rad/s] and the w' [rad/s^2] that keeps it, each (..., 3).

    For any w', z' = w' less the second.
    """
    q0, qv, w_e = error.quaternion[..., :1], error.quaternion[..., 1:], error.w_e
    z = w_e + 2.0 * K * qv
    dqv = 0.5 * (q0 * w_e + cross(qv, w_e))
    return z, error.dwd_b + cross(error.wb, w_e) - 2.0 * K * dqv


@dataclass(frozen=True)
class ManifoldGains(Gyrostat):
    """Gains of the target system and of the manifold's attraction."""

    target_gain: float = gain("1/s", default=10.0, above=0.0)
    """K: rate of the target system sigma_e' = -K sigma_e."""
    manifold_gain: float = gain("1/s", default=5.0, above=0.0)
    """Gamma: rate at which the manifold z = 0 is reached."""


class _Memoryless(ManifoldGains):
    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the empty state."""
        return State()


@dataclass(frozen=True)
class Mrp(_Memoryless):
    """In MRP: z = sigma_e' + K sigma_e, z' = -Gamma z, until an error of 180 deg is crossed.

    sigma_e'' = -(K + Gamma) sigma_e' - K Gamma sigma_e is solved for w_e' as in H. Schaub,
    M. R. Akella, J. L. Junkins, "Adaptive control of nonlinear attitude motions realizing linear
    closed loop dynamics", Journal of Guidance, Control, and Dynamics 24(1), 2001.
    """

    batched: ClassVar[bool] = True

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, MrpSignals]:
        """Return the torque and the errors."""
        K, Gamma, w = self.target_gain, self.manifold_gain, measurement.rate
        error = tracking_error(measurement.attitude, w, reference)
        sigma, w_e = error.sigma_e, error.w_e
        square, along = dot(sigma, sigma), dot(sigma, w_e)
        dsigma = 0.25 * ((1.0 - square) * w_e + 2.0 * cross(sigma, w_e) + 2.0 * along * sigma)
        stiffness = 4.0 * K * Gamma / (1.0 + square) - 0.5 * dot(w_e, w_e)
        dw_e = -(K + Gamma) * w_e - along * w_e - stiffness * sigma
        acceleration = error.dwd_b + cross(error.wb, w_e) + dw_e
        torque = self.torque_for(acceleration, self.total_momentum(measurement), w)
        return state, TorqueCommand(torque), MrpSignals(sigma, dsigma + K * sigma)


@dataclass(frozen=True)
class Quaternion(_Memoryless):
    """In quaternions: z = w_e + 2 K q_v, z' = -Gamma z, until an error of 180 deg is crossed."""

    batched: ClassVar[bool] = True

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, QuaternionSignals]:
        """Return the torque and the errors."""
        error = tracking_error(measurement.attitude, measurement.rate, reference)
        z, kept = manifold(error, self.target_gain)
        acceleration = kept - self.manifold_gain * z
        torque = self.torque_for(acceleration, self.total_momentum(measurement), measurement.rate)
        return state, TorqueCommand(torque), QuaternionSignals(error.sigma_e, z)
