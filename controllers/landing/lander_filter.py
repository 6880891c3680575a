"""Navigation of a lander by inertial sensors, altimeter and velocimeter: an error-state filter.

An extended Kalman filter of the errors of (position, velocity, attitude, accelerometer bias, gyro
bias); the attitude error is a small rotation in body axes. Sola, "Quaternion kinematics for the
error-state Kalman filter", 2017, sections 5 and 6. World axes as in ``descent``. No sensor measures
the horizontal position: its error starts as that of the initial fix and grows with the integrated
error of the velocimeter.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, gain

from . import lander_filter_kernels as kernels
from .lander_gains import LunarGravity


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
        rate, force = measurement.rate, measurement.specific_force
        aid = np.concatenate([measurement.altitude, measurement.ground_velocity], axis=-1)
        found = kernels.predict_and_correct.ufunc(*estimate, rate, force, aid, self._numbers)
        position, velocity, attitude, bias, covariance = found
        return FilterState(position, velocity, attitude, bias, covariance, rate.copy(), aid)

    def estimated(self, estimate: FilterState, measurement: Measurement) -> Measurement:
        """Return ``measurement`` with position, velocity, attitude and rate as estimated."""
        position, velocity, attitude = estimate[:3]
        rate = measurement.rate - estimate.estimated_bias[..., 3:]
        return measurement._replace(
            position=position, velocity=velocity, attitude=attitude, rate=rate
        )

    @cached_property
    def _numbers(self) -> Array:
        inertial = [self.accelerometer_noise, self.gyro_noise]
        walks = [self.accelerometer_walk, self.gyro_walk]
        aids = [self.altimeter_noise, self.velocimeter_noise]
        moon = [self.gravity_parameter, self.moon_radius]
        return np.array([*inertial, *walks, *aids, *moon, self.control_period])
