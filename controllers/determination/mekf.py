"""The multiplicative extended Kalman filter of attitude and gyro bias.

Lefferts, Markley and Shuster 1982, "Kalman Filtering for Spacecraft Attitude Estimation"; Markley
and Crassidis 2014, "Fundamentals of Spacecraft Attitude Determination and Control", section 6.2.
The gyro takes the place of a model of the torques. The reset of the attitude error leaves the
covariance as it is: it would change by the product of two small angles.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross_matrix, dot, matrix_product, transpose
from mjspace.attitude import conjugate, from_rotation_vector, normalize, rotate, to_matrix
from mjspace.contract import Array, Gains, Measurement, Unit, gain

from .error_state import attitude_error, corrected, mean_rate, turned
from .samples import is_new, is_sample
from .vector_observations import covariance, q_method

ATTITUDE, BIAS = slice(0, 3), slice(3, 6)
"""Where the errors stand among the 6, as their covariance has them."""
UNKNOWN = np.pi
"""Standard deviation [rad] of an attitude of which nothing is known."""


class State(NamedTuple):
    """Memory of the filter."""

    attitude: Array
    """Estimated quaternion, body to inertial, (..., 4)."""
    gyro_bias: Annotated[Array, Unit("rad/s")]
    """Estimated, body axes [rad/s], (..., 3)."""
    covariance: Array
    """Of the errors of attitude [rad] and bias [rad/s], body axes, (..., 6, 6)."""
    last_rate: Annotated[Array, Unit("rad/s")]
    """Last sample of the gyro [rad/s], (..., 3)."""
    last_samples: Array
    """Last ones of the other sensors, in the order of their gains: an unchanged one is not new."""
    propagates: Array
    """0.0 at the first step, which is at the instant of the reset, then 1.0, (..., 1)."""


class Estimate(NamedTuple):
    """What is estimated."""

    attitude: Array
    """Quaternion, body to inertial, (..., 4)."""
    rate: Annotated[Array, Unit("rad/s")]
    """The gyro's less its estimated bias, body axes [rad/s], (..., 3)."""
    gyro_bias: Annotated[Array, Unit("rad/s")]
    """Body axes [rad/s], (..., 3)."""
    covariance: Array
    """Of the errors of attitude [rad] and bias [rad/s], body axes, (..., 6, 6)."""
    attitude_bound: Annotated[Array, Unit("rad")]
    """Three standard deviations of the attitude error about each body axis [rad], (..., 3)."""
    innovation: Array
    """Normalized innovation squared of each sensor that is used, 0 without a new sample, (..., k):
    its mean is the number of components that have information, 2 of the Sun's direction."""


@dataclass(frozen=True, kw_only=True)
class MEKF(Gains):
    """The filter; its gains are standard deviations of one sample, the same on each axis.

    It uses the sensors whose standard deviation is given: a star tracker (``attitude``), a Sun
    sensor (``sun_direction`` with ``sun_reference``) and a magnetometer (``magnetic_field`` with
    ``field_reference``). A vector of zeros is no sample, and neither is one whose
    ``<quantity>_valid`` is 0. It starts with the star tracker's attitude, else with that of the
    Sun's and the field's directions by the q method; where one of them lacks at first, from an
    attitude of which nothing is known, which a filter of small errors may take long to find.
    """

    batched: ClassVar[bool] = True

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next; the gyro has the same."""
    gyro_noise: float = gain("rad/s", at_least=0.0)
    """Of the gyro's white noise."""
    gyro_bias: float = gain("rad/s", at_least=0.0)
    """Of the gyro's initial bias."""
    gyro_walk: float = gain("rad/s", default=0.0, at_least=0.0)
    """Of the random walk of the gyro's bias after one second."""
    attitude_noise: float = gain("rad", default=0.0, at_least=0.0)
    """Of the star tracker; 0: it is not used."""
    sun_noise: float = gain("rad", default=0.0, at_least=0.0)
    """Of the Sun's direction; 0: it is not used."""
    field_noise: float = gain("T", default=0.0, at_least=0.0)
    """Of the magnetic field; 0: it is not used."""

    def __post_init__(self) -> None:
        """Refuse a filter without a sensor of the attitude."""
        super().__post_init__()
        if not (self.attitude_noise or self.sun_noise or self.field_noise):
            raise ValueError(
                "attitude_noise: got 0, as sun_noise and field_noise: give that of a sensor"
            )

    def reset(self, measurement: Measurement) -> State:
        """Return the estimate by the first samples, without a bias.

        Raises:
            AttributeError: one of the sensors is missing.
        """
        lead = measurement.rate.shape[:-1]
        attitude, spread = self._fix(measurement)
        P = np.zeros((*lead, 6, 6))
        P[..., ATTITUDE, ATTITUDE] = spread
        P[..., BIAS, BIAS] = self.gyro_bias**2 * np.eye(3)
        none = np.zeros((*lead, 3))
        return State(
            attitude, none, P, measurement.rate.copy(), self._samples(measurement), none[..., :1]
        )

    def step(self, state: State, time: float, measurement: Measurement) -> tuple[State, Estimate]:
        """Return (state, estimate) with the samples of now."""
        rate, samples = measurement.rate, self._samples(measurement)
        q, P = self._propagated(state, rate)
        q, b, P, squares = self._updated(q, state.gyro_bias, P, state.last_samples, measurement)
        bound = 3.0 * np.sqrt(np.diagonal(P, axis1=-2, axis2=-1)[..., ATTITUDE])
        after = State(q, b, P, rate.copy(), samples, np.ones_like(state.propagates))
        return after, Estimate(q.copy(), rate - b, b.copy(), P.copy(), bound, squares)

    def _propagated(self, state: State, rate: Array) -> tuple[Array, Array]:
        """Return attitude and covariance a control period later, by the gyro alone.

        The transition is exact for a constant rate but for terms of order h^3 |rate|^2 in the
        bias's part; the noise is that of section 6.2, with white noise of each sample.
        """
        h = self.control_period * state.propagates
        w = mean_rate(state.last_rate, rate, state.gyro_bias)
        half = transpose(to_matrix(from_rotation_vector(0.5 * h * w)))
        h = h[..., None]
        phi = np.zeros_like(state.covariance)
        phi[..., ATTITUDE, ATTITUDE] = matrix_product(half, half)
        phi[..., ATTITUDE, BIAS] = -h * half
        phi[..., BIAS, BIAS] = np.eye(3)
        noise = np.zeros_like(phi)
        walk = self.gyro_walk**2 * np.eye(3)
        noise[..., ATTITUDE, ATTITUDE] = h**2 * self.gyro_noise**2 * np.eye(3) + h**3 / 3.0 * walk
        noise[..., ATTITUDE, BIAS] = noise[..., BIAS, ATTITUDE] = -(h**2) / 2.0 * walk
        noise[..., BIAS, BIAS] = h * walk
        P = matrix_product(matrix_product(phi, state.covariance), transpose(phi)) + noise
        return turned(state.attitude, w, h[..., 0]), P

    def _updated(
        self, q: Array, b: Array, P: Array, last: Array, measurement: Measurement
    ) -> tuple[Array, Array, Array, Array]:
        """Return attitude, bias, covariance and normalized innovations with the new samples."""
        x, H = np.zeros_like(P[..., 0]), np.zeros_like(P[..., :3, :])
        squares, begin = [], 0
        if self.attitude_noise:
            sample = measurement.attitude
            fresh = is_new("attitude", measurement, last[..., :4])
            H[..., ATTITUDE] = np.eye(3)
            x, P, square = corrected(x, P, H, attitude_error(q, sample), self.attitude_noise, fresh)
            squares, begin = [square], 4
        for quantity, inertial, noise in self._vectors(measurement):
            sample = getattr(measurement, quantity)
            fresh = is_new(quantity, measurement, last[..., begin : begin + 3])
            expected = rotate(conjugate(q), inertial)
            # A rotation theta changes R^T r by expected x theta.
            H[..., ATTITUDE] = cross_matrix(expected)
            x, P, square = corrected(x, P, H, sample - expected, noise, fresh)
            squares, begin = [*squares, square], begin + 3
        P = 0.5 * (P + transpose(P))  # against rounding
        q = normalize(turned(q, x[..., ATTITUDE], np.ones_like(x[..., :1])))
        return q, b + x[..., BIAS], P, np.concatenate(squares, axis=-1)

    def _vectors(self, measurement: Measurement) -> list[tuple[str, Array, float]]:
        """Return (quantity, its inertial components, standard deviation) of each that is used."""
        used: list[tuple[str, Array, float]] = []
        if self.sun_noise:
            used.append(("sun_direction", measurement.sun_reference, self.sun_noise))
        if self.field_noise:
            used.append(("magnetic_field", measurement.field_reference, self.field_noise))
        return used

    def _samples(self, measurement: Measurement) -> Array:
        """Return the samples that are used in one array."""
        quantities = [quantity for quantity, _, _ in self._vectors(measurement)]
        quantities = ["attitude"] * (self.attitude_noise > 0.0) + quantities
        return np.concatenate([getattr(measurement, each) for each in quantities], axis=-1)

    def _fix(self, measurement: Measurement) -> tuple[Array, Array]:
        """Return the attitude (..., 4) by the first samples, and its covariance (..., 3, 3)."""
        if self.attitude_noise:
            return measurement.attitude.copy(), self.attitude_noise**2 * np.eye(3)
        vectors = self._vectors(measurement)
        body, inertial, weight = [], [], []
        for quantity, known, noise in vectors:
            sample = getattr(measurement, quantity)
            size = np.sqrt(dot(known, known))
            good = is_sample(quantity, measurement)
            body.append(normalize(np.where(good, sample, 1.0)))
            inertial.append(known / size)
            relative = noise if quantity == "sun_direction" else noise / size
            weight.append(np.where(good, 1.0 / relative**2, 0.0))
        b, r = np.stack(body, axis=-2), np.stack(inertial, axis=-2)
        w = np.concatenate(weight, axis=-1)
        good = np.sum(w > 0.0, axis=-1, keepdims=True) > 1
        spread = covariance(b, np.where(good, w, 1.0))
        spread = np.where(good[..., None], spread, UNKNOWN**2 * np.eye(3))
        return q_method(b, r, w), spread
