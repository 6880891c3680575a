"""The rate of a satellite with reaction wheels from its attitude and tachometers, without a gyro.

No torque acts from outside, so that the total momentum hI is constant in inertial axes and
w = H0^-1 (R^T hI - h), with H0 the inertia with the wheels locked and h = sum a Jw Omega. With
eps = conj(q_o) q, the error of the observed attitude q_o, of the shorter turn, and estimates w_o
and hI_o:

    q_o' = q_o [0, w_o + l1 eps_v] / 2,    hI_o' = l2 c^2 R H0^-1 eps_v,    c = tr H0 / 3.

V = 2 (1 - eps_0) + |hI_o - hI|^2 / (2 l2 c^2) has V' = -l1 |eps_v|^2, under any control. S.
Salcudean, "A globally convergent angular velocity observer for rigid body motion", IEEE
Transactions on Automatic Control 36(12), 1991, has the idea for a body without wheels.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mjspace.algebra import times, transpose
from mjspace.attitude import conjugate, from_rotation_vector, multiply, rotate, to_matrix
from mjspace.contract import Array, Measurement, gain

from .gyrostat import Gyrostat
from .tracking_error import shorter


class RateState(NamedTuple):
    """Memory of the observer."""

    attitude: Array
    """Observed quaternion q_o, body to inertial, (..., 4)."""
    momentum: Array
    """Estimated total momentum hI_o, inertial axes [N m s], (..., 3)."""


@dataclass(frozen=True, kw_only=True)
class RateObserverGains(Gyrostat):
    """Gains of the observer, integrated by explicit Euler at the control period."""

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    attitude_injection: float = gain("1/s", default=20.0, above=0.0)
    """l1."""
    momentum_injection: float = gain("1/s^2", default=100.0, above=0.0)
    """l2: small errors have poles s^2 + l1 s / 2 + l2 (c / H0)^2 / 2 = 0 about each principal axis,
    of inertia H0."""

    def at_rest(self, measurement: Measurement) -> RateState:
        """Return the state of an estimated rate of zero, at the measured attitude."""
        q = measurement.attitude
        return RateState(q.copy(), rotate(q, self.relative_momentum(measurement)))

    def observed(
        self, state: RateState, measurement: Measurement
    ) -> tuple[RateState, Array, Array]:
        """Return the next state, the rate w_o [rad/s] and the momentum [N m s], body axes.

        ``measurement.rate`` is not read.
        """
        R = to_matrix(measurement.attitude)
        p = times(transpose(R), state.momentum)
        w = times(self.locked_inverse, p - self.relative_momentum(measurement))
        eps = shorter(multiply(conjugate(state.attitude), measurement.attitude))[..., 1:]
        turn = self.control_period * (w + self.attitude_injection * eps)
        change = self._momentum_gain * times(R, times(self.locked_inverse, eps))
        after = RateState(
            multiply(state.attitude, from_rotation_vector(turn)),
            state.momentum + self.control_period * change,
        )
        return after, w, p

    @cached_property
    def _momentum_gain(self) -> float:
        """l2 c^2 [(kg m^2/s)^2]."""
        return self.momentum_injection * (float(np.trace(self.locked)) / 3.0) ** 2
