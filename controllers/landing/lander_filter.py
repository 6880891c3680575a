"""Navigation of a lander by inertial sensors, altimeter and velocimeter: an error-state filter.

An extended Kalman filter of the errors of (position, velocity, attitude, accelerometer bias, gyro
bias); the attitude error is a small rotation in body axes. Sola, "Quaternion kinematics for the
error-state Kalman filter", 2017, sections 5.4 and 6, whose reset (6.3) is left out: it changes the
covariance by the product of two small angles. World axes as in ``descent``. No sensor measures the
horizontal position: its error starts as that of the initial fix and grows with the integrated error
of the velocimeter. The altimeter measures the height above the Moon's sphere.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mjspace.algebra import cross_matrix, matrix_product, times, transpose
from mjspace.attitude import from_rotation_vector, multiply, normalize, to_matrix
from mjspace.contract import Array, Measurement, gain

from ..determination.error_state import corrected, mean_rate, turned
from .lander_gains import LunarGravity

POSITION, VELOCITY, ATTITUDE, FORCE_BIAS, GYRO_BIAS = (slice(k, k + 3) for k in range(0, 15, 3))
BIAS = slice(9, 15)
"""Where the errors stand among the 15, as their covariance has them."""


class FilterState(NamedTuple):
    """State of the filter: estimates and their covariance."""

    estimated_position: Array
    """World axes [m], (..., 3)."""
    estimated_velocity: Array
    """World axes [m/s], (..., 3)."""
    estimated_attitude: Array
    """Quaternion, body to world, (..., 4)."""
    estimated_bias: Array
    """Biases of the accelerometer [m/s^2], then of the gyro [rad/s], body axes, (..., 6)."""
    covariance: Array
    """Of the errors in the order above, attitude error in body axes [rad], (..., 15, 15)."""
    last_rate: Array
    """Last sample of the gyro [rad/s], (..., 3)."""
    last_aid: Array
    """Last altitude [m] and ground velocity [m/s], (..., 4): an unchanged value is no new sample.
    Infinite before the first."""


@dataclass(frozen=True, kw_only=True)
class Navigation(LunarGravity):
    """The filter. Its gains are standard deviations of one sample, the same on each axis."""

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next; the gyro and the accelerometer have the same."""
    position_fix: float = gain("m", default=20.0, at_least=0.0)
    """Of the initial position, the only one that the filter reads."""
    velocity_fix: float = gain("m/s", default=1.0, at_least=0.0)
    """Of the initial velocity, the only one that the filter reads."""
    attitude_fix: float = gain("rad", default=0.01, at_least=0.0)
    """Of the initial attitude, the only one that the filter reads."""
    gyro_noise: float = gain("rad/s", default=1e-3, at_least=0.0)
    """Of the gyro's white noise."""
    gyro_bias: float = gain("rad/s", default=1e-4, at_least=0.0)
    """Of the gyro's initial bias."""
    gyro_walk: float = gain("rad/s", default=1e-6, at_least=0.0)
    """Of the random walk of the gyro's bias after one second."""
    accelerometer_noise: float = gain("m/s^2", default=0.01, at_least=0.0)
    """Of the accelerometer's white noise; it measures the mean over a period."""
    accelerometer_bias: float = gain("m/s^2", default=0.005, at_least=0.0)
    """Of the accelerometer's initial bias."""
    accelerometer_walk: float = gain("m/s^2", default=1e-5, at_least=0.0)
    """Of the random walk of the accelerometer's bias after one second."""
    altimeter_noise: float = gain("m", default=0.5, above=0.0)
    """Of the altitude."""
    velocimeter_noise: float = gain("m/s", default=0.05, above=0.0)
    """Of the ground velocity."""

    def fix(self, measurement: Measurement) -> FilterState:
        """Return the initial estimates, with position, velocity and attitude as measured.

        Raises:
            AttributeError: one of the sensors is missing.
        """
        lead = measurement.rate.shape[:-1]
        spread = [self.position_fix, self.velocity_fix, self.attitude_fix]
        spread += [self.accelerometer_bias, self.gyro_bias]
        start = np.diag(np.repeat(spread, 3) ** 2)
        return FilterState(
            measurement.position.copy(),
            measurement.velocity.copy(),
            measurement.attitude.copy(),
            np.zeros((*lead, 6)),
            np.broadcast_to(start, (*lead, 15, 15)).copy(),
            measurement.rate.copy(),
            np.full((*lead, 4), np.inf),
        )

    def navigate(self, estimate: FilterState, measurement: Measurement) -> FilterState:
        """Return the estimates a period later, or at the same instant right after ``fix``."""
        p, v, q, b, P = self._predicted(estimate, measurement)
        altitude, ground_velocity = measurement.altitude, measurement.ground_velocity
        x = np.zeros_like(P[..., 0])
        H = np.zeros_like(P[..., :1, :])
        H[..., 0, POSITION] = self.upward(p)
        fresh = altitude != estimate.last_aid[..., :1]
        innovation = altitude - self.altitude(p)
        x, P, _ = corrected(x, P, H, innovation, self.altimeter_noise, fresh)

        R_T = transpose(to_matrix(q))
        velocity_b = times(R_T, v)
        H = np.zeros_like(P[..., :3, :])
        # A rotation theta changes R^T v by velocity_b x theta.
        H[..., VELOCITY], H[..., ATTITUDE] = R_T, cross_matrix(velocity_b)
        changed = ground_velocity != estimate.last_aid[..., 1:]
        fresh = np.any(changed, axis=-1, keepdims=True)
        innovation = ground_velocity - velocity_b
        x, P, _ = corrected(x, P, H, innovation, self.velocimeter_noise, fresh)

        p, v, b = p + x[..., POSITION], v + x[..., VELOCITY], b + x[..., BIAS]  # section 6.2
        q = normalize(multiply(q, from_rotation_vector(x[..., ATTITUDE])))
        aid = np.concatenate([altitude, ground_velocity], axis=-1)
        return FilterState(p, v, q, b, P, measurement.rate.copy(), aid)

    def _predicted(self, estimate: FilterState, measurement: Measurement) -> tuple[Array, ...]:
        """Return p, v, q, the biases and P by the inertial sensors, sections 5.4.1 to 5.4.3.

        Of order two in the period h, with the attitude halfway; P of order one.
        """
        p, v, q, b, P, last_rate, last_aid = estimate
        h = np.where(np.isinf(last_aid[..., :1]), 0.0, self.control_period)
        f = measurement.specific_force - b[..., :3]
        w = mean_rate(last_rate, measurement.rate, b[..., 3:])
        R = to_matrix(multiply(q, from_rotation_vector(0.5 * h * w)))
        v_ = v + h * (times(R, f) + self.gravity(p))
        p_ = p + 0.5 * h * (v + v_)
        q_ = turned(q, w, h)

        A = np.zeros_like(P)  # of the errors' equations, section 5.3.3
        A[..., POSITION, VELOCITY] = np.eye(3)
        A[..., VELOCITY, ATTITUDE] = -matrix_product(R, cross_matrix(f))
        A[..., VELOCITY, FORCE_BIAS] = -R
        A[..., ATTITUDE, ATTITUDE] = -cross_matrix(w)
        A[..., ATTITUDE, GYRO_BIAS] = -np.eye(3)
        h = h[..., None]
        phi = np.eye(15) + h * A
        white, walk = self._noise
        P_ = matrix_product(matrix_product(phi, P), transpose(phi)) + h**2 * white + h * walk
        return p_, v_, q_, b, P_

    def estimated(self, estimate: FilterState, measurement: Measurement) -> Measurement:
        """Return ``measurement`` with position, velocity, attitude and rate as estimated."""
        position, velocity, attitude = estimate[:3]
        rate = measurement.rate - estimate.estimated_bias[..., 3:]
        return measurement._replace(
            position=position, velocity=velocity, attitude=attitude, rate=rate
        )

    @cached_property
    def _noise(self) -> tuple[Array, Array]:
        """Variances that white noise adds, over h^2, and random walks, over h, each (15, 15)."""
        white = [0.0, self.accelerometer_noise, self.gyro_noise, 0.0, 0.0]
        walk = [0.0, 0.0, 0.0, self.accelerometer_walk, self.gyro_walk]
        return np.diag(np.repeat(white, 3) ** 2), np.diag(np.repeat(walk, 3) ** 2)
