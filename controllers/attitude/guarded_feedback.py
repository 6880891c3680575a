"""Quaternion feedback that outlives a blinded star tracker and a gyro that is stuck.

The rate is the median of three gyros, component by component: whatever one of them reports, it is
between those of the two others. The attitude follows the rate, and is drawn to the star tracker's
where that is valid: the passive complementary filter, without its estimate of a bias, in discrete
time (R. Mahony, T. Hamel and J.-M. Pflimlin, "Nonlinear complementary filters on the special
orthogonal group", IEEE Transactions on Automatic Control 53, 2008). The feedback is
``quaternion_feedback:Switched``. All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mjspace.attitude import conjugate, from_rotation_vector, multiply, normalize
from mjspace.contract import Array, Measurement, Reference, TorqueCommand, gain

from .quaternion_feedback import Switched


class State(NamedTuple):
    """Memory of this law."""

    attitude: Array
    """Estimated quaternion, on a continuous path, (..., 4)."""
    sign: Array
    """Sign of k: 1.0 or -1.0, (..., 1)."""
    path: Array
    """Length of the path so far: the integral of |w| [rad], (..., 1)."""
    impulse: Array
    """Integral of |u| so far [N m s], (..., 1)."""
    rate: Array
    """Last rate [rad/s], body axes, (..., 3)."""


class Signals(NamedTuple):
    """Signals of this law."""

    error: Array
    """conj(q_ref) q of the estimate, (..., 4)."""
    k: Array
    """Present gain with its sign [N m], (..., 1)."""
    u: Array
    """Commanded torque on the bus without h x w [N m], body axes, (..., 3)."""
    path: Array
    """As in the state, (..., 1)."""
    impulse: Array
    """As in the state, (..., 1)."""
    rate: Array
    """Median of the gyros [rad/s], body axes, (..., 3)."""
    estimate: Array
    """Estimated attitude, (..., 4)."""


@dataclass(frozen=True)
class Guarded(Switched):
    """Feedback of an estimate from a star tracker and ``gyro_1``, ``gyro_2`` and ``gyro_3``."""

    correction: float = gain(default=0.02, above=0.0, at_most=1.0)
    """Part of its difference from the star tracker that the estimate makes up in a period."""

    def reset(self, measurement: Measurement, reference: Reference) -> Any:
        """Return the initial state: the star tracker's attitude."""
        return State(*super().reset(measurement, reference), _median(measurement))

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[Any, TorqueCommand, Any]:
        """Return the next state, the torque on the bus and the signals."""
        rate = _median(measurement)
        turn = from_rotation_vector(0.5 * self.control_period * (state.rate + rate))
        predicted = multiply(state.attitude, turn)
        off = multiply(conjugate(predicted), measurement.attitude)
        off = np.where(off[..., :1] < 0.0, -off, off)
        part = np.where(measurement.attitude_valid > 0.5, 2.0 * self.correction, 0.0)
        drawn = multiply(predicted, from_rotation_vector(part * off[..., 1:]))
        estimate = normalize(drawn)
        seen = measurement._replace(attitude=estimate, rate=rate)
        after, command, signals = super().step(state, time, seen, reference)
        return State(*after, rate), command, Signals(*signals, rate, estimate)


def _median(measurement: Measurement) -> Array:
    """Return the median of the three gyros [rad/s], (..., 3)."""
    a, b, c = measurement.gyro_1, measurement.gyro_2, measurement.gyro_3
    middle: Array = np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))
    return middle
