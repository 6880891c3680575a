"""Where a lander is, from inertial sensors, an altimeter and a velocimeter: an error-state filter.

An extended Kalman filter of the errors of (position, velocity, attitude, accelerometer bias, gyro
bias), the attitude's a small turn in body axes: Sola, "Quaternion kinematics for the error-state
Kalman filter", 2017, sections 5 and 6. World axes as in ``descent``. Nothing shows where the lander
is along the ground: that error grows with the velocimeter's, from what it was at the start.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mjspace.contract import Array, Gains, Measurement, gain

from . import lander_filter_kernels as kernels


class Belief(NamedTuple):
    """What the filter remembers."""

    believed_position: Array
    """World axes [m], (..., 3)."""
    believed_velocity: Array
    """World axes [m/s], (..., 3)."""
    believed_attitude: Array
    """Quaternion, body to world, (..., 4)."""
    believed_bias: Array
    """Of the accelerometer [m/s^2], then of the gyro [rad/s], body axes, (..., 6)."""
    covariance: Array
    """Of the errors in the order above, the attitude's in body axes [rad], (..., 15, 15)."""
    last_rate: Array
    """The gyro's last sample [rad/s], (..., 3)."""
    last_aid: Array
    """Last altitude [m] and ground velocity [m/s], (..., 4): what is unchanged is old. Infinite
    before the first."""


@dataclass(frozen=True, kw_only=True)
class Navigation(Gains):
    """The filter's gains: standard deviations, each of one sample and on each axis."""

    control_period: float = gain("s", above=0.0)
    """Of ``step``, and of the gyro and the accelerometer."""
    position_fix: float = gain("m", default=20.0, at_least=0.0)
    """Of the position at the start, the last that is read."""
    velocity_fix: float = gain("m/s", default=1.0, at_least=0.0)
    """Of the velocity at the start, likewise."""
    attitude_fix: float = gain("rad", default=0.01, at_least=0.0)
    """Of the attitude at the start, likewise."""
    gyro_noise: float = gain("rad/s", default=1e-3, at_least=0.0)
    """Of the white noise of ``rate``."""
    gyro_bias: float = gain("rad/s", default=1e-4, at_least=0.0)
    """Of its bias at the start."""
    gyro_walk: float = gain("rad/s", default=1e-6, at_least=0.0)
    """Of its bias's walk in one second."""
    accelerometer_noise: float = gain("m/s^2", default=0.01, at_least=0.0)
    """Of the white noise of ``specific_force``, the mean of a period."""
    accelerometer_bias: float = gain("m/s^2", default=0.005, at_least=0.0)
    """Of its bias at the start."""
    accelerometer_walk: float = gain("m/s^2", default=1e-5, at_least=0.0)
    """Of its bias's walk in one second."""
    altimeter_noise: float = gain("m", default=0.5, above=0.0)
    """Of ``altitude``."""
    velocimeter_noise: float = gain("m/s", default=0.05, above=0.0)
    """Of ``ground_velocity``."""
    gravity_parameter: float = gain("m^3/s^2", default=4.902e12, above=0.0)
    """mu of the Moon."""
    moon_radius: float = gain("m", default=1.738e6, above=0.0)
    """Of the landing site."""

    def fix(self, measurement: Measurement) -> Belief:
        """Return the belief at the start, at the position, velocity and attitude measured then.

        Raises:
            AttributeError: one of the sensors is missing.
        """
        seen = measurement
        lead = seen.rate.shape[:-1]
        spread = [self.position_fix, self.velocity_fix, self.attitude_fix]
        spread += [self.accelerometer_bias, self.gyro_bias]
        start = np.diag(np.repeat(spread, 3) ** 2)
        return Belief(
            seen.position.copy(),
            seen.velocity.copy(),
            seen.attitude.copy(),
            np.zeros((*lead, 6)),
            np.broadcast_to(start, (*lead, 15, 15)).copy(),
            seen.rate.copy(),
            np.full((*lead, 4), np.inf),
        )

    def navigate(self, belief: Belief, measurement: Measurement) -> Belief:
        """Return the belief a period later, or at the same instant right after ``fix``."""
        seen = measurement
        aid = np.concatenate([seen.altitude, seen.ground_velocity], axis=-1)
        found = kernels.move_and_correct(
            *belief, seen.rate, seen.specific_force, aid, self._numbers
        )
        place, velocity, attitude, bias, covariance = found
        return Belief(place, velocity, attitude, bias, covariance, seen.rate.copy(), aid)

    def believed(self, belief: Belief, measurement: Measurement) -> Measurement:
        """Return the measurement with what is believed in place of the place and the attitude."""
        place, velocity, attitude = belief[:3]
        rate = measurement.rate - belief.believed_bias[..., 3:]
        return measurement._replace(position=place, velocity=velocity, attitude=attitude, rate=rate)

    @cached_property
    def _numbers(self) -> Array:
        inertial = [self.accelerometer_noise, self.gyro_noise]
        walks = [self.accelerometer_walk, self.gyro_walk]
        aids = [self.altimeter_noise, self.velocimeter_noise]
        moon = [self.gravity_parameter, self.moon_radius]
        return np.array([*inertial, *walks, *aids, *moon, self.control_period])
