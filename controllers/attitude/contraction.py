"""Attitude tracking by contraction analysis, known or estimated inertia: Servín 2022 (paper 002).

The error is e = w - wd, where the desired rate wd = 2 J(q)^T (qd' + lc qd) steers q to qd. All
arrays may have leading vehicle axes. q and -q are one attitude: at reset each law takes the sign of
q nearer to qd, and then keeps the path of q continuous. This avoids unwinding (erratum 10), and the
sign that a sensor reports does not matter.
"""

from dataclasses import dataclass
from math import inf
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import dot, matrix_product, times, transpose
from mjspace.attitude import conjugate, multiply, pure
from mjspace.contract import Array, Gains, Measurement, Reference, TorqueCommand, gain

from .excitation import least_eigenvalue
from .gyrostat import Gyrostat
from .inertia_regressor import momentum_columns, regressor


class IdealState(NamedTuple):
    """Memory of the ideal law."""

    attitude: Array
    """Last measured quaternion, on the branch chosen at reset, (..., 4)."""


class IdealSignals(NamedTuple):
    """Signals of the ideal law."""

    e: Array
    """w - wd [rad/s], body axes, (..., 3)."""
    wd: Array
    """Desired rate [rad/s], body axes, (..., 3)."""


class GradientState(NamedTuple):
    """Memory of the gradient law: that of the ideal law, and the estimates."""

    attitude: Array
    theta_hat: Array
    """Estimates of m11 m12 m13 m22 m23 m33 [kg m^2] and of the momentum hI [N m s], (..., 9)."""


class GradientSignals(NamedTuple):
    """Signals of the gradient law: those of the ideal law, and the estimates in use."""

    e: Array
    wd: Array
    theta_hat: Array


class AdaptiveState(NamedTuple):
    """Memory of the adaptive law: that of the gradient law, its information and its filters."""

    attitude: Array
    theta_hat: Array
    g: Array
    """Z times the estimation error, computed without the true parameters, (..., 9)."""
    Z: Array
    """Information matrix of the parameters, (..., 9, 9)."""
    w_f: Array
    """Filtered rate [rad/s], (..., 3)."""
    P_f: Array
    """Filtered S(w) R^T [rad/s], (..., 3, 3)."""
    t_f: Array
    """Filtered torque [N m], (..., 3)."""


class AdaptiveSignals(NamedTuple):
    """Signals of the adaptive law: those of the gradient law, prediction error and excitation."""

    e: Array
    wd: Array
    theta_hat: Array
    eps: Array
    """Yf theta_hat less the filtered torque [N m], (..., 3)."""
    excitation: Array
    """lambda_z of (4.10): the least eigenvalue of Z. All parameters converge only if it stays above
    zero, (..., 1)."""


@dataclass(frozen=True, kw_only=True)
class _Contraction(Gains):
    """Gains of every law of this module."""

    rate_gain: float = gain("N m s/rad", default=25.0, above=0.0)
    """Kc, the same on each axis."""
    attitude_gain: float = gain("1/s", default=25.0, above=0.0)
    """lc: contraction rate of the attitude."""
    torque_limit: float = gain("N m", default=inf, above=0.0, at_most=inf)
    """Largest command on each axis."""

    def _tracking(
        self, before: Array, measurement: Measurement, reference: Reference
    ) -> tuple[Array, Array, Array, Array]:
        """Return q on its path from ``before``, e = w - wd, wd, (3.8), and wd', (3.9)-(3.10)."""
        q, w = _on_path(measurement.attitude, before), measurement.rate
        lc, qd, wr = self.attitude_gain, reference.attitude, reference.rate
        dqd = 0.5 * _rate(qd, wr)
        ddqd = 0.5 * (_rate(qd, reference.acceleration) + _rate(dqd, wr))
        u, du = dqd + lc * qd, ddqd + lc * dqd
        wd = 2.0 * _along(q, u)
        dwd = 2.0 * _along(q, du) - _along(u, _rate(q, w))
        return q, w - wd, wd, dwd

    def _limited(self, torque: Array) -> Array:
        return np.clip(torque, -self.torque_limit, self.torque_limit)


@dataclass(frozen=True)
class Ideal(Gyrostat, _Contraction):
    """Known inertia: tau = H wd' - p x wd - Kc e, (3.6).

    The printed h = R^T hI needs a constant momentum. Here p = H w + sum a Jw (a.w + Omega) from the
    tachometers, which is equal on a torque-free vehicle and valid under any torque.
    """

    batched: ClassVar[bool] = True

    def reset(self, measurement: Measurement, reference: Reference) -> IdealState:
        """Return the initial state, with the sign of q nearer to the reference."""
        return IdealState(_nearer(measurement, reference))

    def step(
        self, state: IdealState, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[IdealState, TorqueCommand, IdealSignals]:
        """Return the next state, the torque and the errors."""
        q, e, wd, dwd = self._tracking(state.attitude, measurement, reference)
        forward = self.torque_for(dwd, self.total_momentum(measurement), wd)
        torque = forward - self.rate_gain * e  # (3.6)
        return IdealState(q), TorqueCommand(self._limited(torque)), IdealSignals(e, wd)


@dataclass(frozen=True)
class Gradient(_Contraction):
    """Estimated inertia, by the gradient alone: tau = Y theta_hat - Kc e, theta_hat' = -ga Y^T e.

    Equations (4.2) and (4.21); ga is above zero, where the paper prints zero (erratum 19). The
    estimate of hI assumes a constant total momentum. Integrated by explicit Euler at the control
    period.
    """

    batched: ClassVar[bool] = True

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    adaptation_gain: float = gain(default=1.0, above=0.0)
    """ga."""

    def reset(self, measurement: Measurement, reference: Reference) -> GradientState:
        """Return the initial state: estimates of zero, the sign of q nearer to the reference."""
        lead = measurement.rate.shape[:-1]
        return GradientState(_nearer(measurement, reference), np.zeros((*lead, 9)))

    def step(
        self, state: GradientState, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[GradientState, TorqueCommand, GradientSignals]:
        """Return the next state, the torque, the errors and the estimates."""
        q, e, wd, dwd = self._tracking(state.attitude, measurement, reference)
        Y = regressor(dwd, momentum_columns(wd, q))
        torque = times(Y, state.theta_hat) - self.rate_gain * e  # (4.2)
        dtheta = -self.adaptation_gain * times(transpose(Y), e)  # (4.21), erratum 19
        after = GradientState(q, state.theta_hat + self.control_period * dtheta)
        signals = GradientSignals(e, wd, state.theta_hat)
        return after, TorqueCommand(self._limited(torque)), signals


@dataclass(frozen=True)
class Adaptive(_Contraction):
    """Estimated inertia and momentum: the composite law (4.2), (4.5)-(4.9).

    Corrected by erratum 15: ga Yf^T eps, and da ga Z. The estimate of hI assumes a constant total
    momentum. The nine parameters converge only if the motion excites them; a rotation about one
    fixed axis does not (erratum 21). Explicit Euler at the control period: at 1 kHz the sweep's
    largest |q - qd| is 2.33e-2, against 2.32e-2 in continuous time. The filter uses the limited
    torque, so ``torque_limit`` must not exceed that of the actuators.
    """

    batched: ClassVar[bool] = True

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    filter_bandwidth: float = gain("rad/s", default=2.0, above=0.0)
    """lF: of the filters that replace the unmeasured acceleration."""
    adaptation_coupling: float = gain(default=2.0, above=0.0)
    """da: weight of the prediction error relative to the tracking error."""
    adaptation_gain: float = gain(default=1.0, above=0.0)
    """ga."""
    forgetting: float = gain("1/s", default=0.1, at_least=0.0)
    """lf: forgetting rate of the information matrix."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.filter_bandwidth * self.control_period >= 1.0:
            raise ValueError(
                f"filter_bandwidth: got {self.filter_bandwidth:g} rad/s, should be less than "
                f"{1 / self.control_period:g} rad/s at a control_period of "
                f"{self.control_period:g} s"
            )

    def reset(self, measurement: Measurement, reference: Reference) -> AdaptiveState:
        """Return the initial state: estimates of zero, the sign of q nearer to the reference.

        The filtered rate starts at the rate: from zero it would keep an error (erratum 25).
        """
        lead = measurement.rate.shape[:-1]
        theta_hat, g, Z = np.zeros((*lead, 9)), np.zeros((*lead, 9)), np.zeros((*lead, 9, 9))
        w_f, P_f, t_f = measurement.rate.copy(), np.zeros((*lead, 3, 3)), np.zeros((*lead, 3))
        return AdaptiveState(_nearer(measurement, reference), theta_hat, g, Z, w_f, P_f, t_f)

    def step(
        self, state: AdaptiveState, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[AdaptiveState, TorqueCommand, AdaptiveSignals]:
        """Return the next state, the torque, the errors and the estimates."""
        attitude, theta_hat, g, Z, w_f, P_f, t_f = state
        ga, da = self.adaptation_gain, self.adaptation_coupling
        lF, lf = self.filter_bandwidth, self.forgetting
        w, T = measurement.rate, self.control_period
        q, e, wd, dwd = self._tracking(attitude, measurement, reference)

        Y = regressor(dwd, momentum_columns(wd, q))
        torque = self._limited(times(Y, theta_hat) - self.rate_gain * e)  # (4.2)

        # The filter lF/(s + lF) of (2.41)-(2.44); the derivative of the filtered rate replaces w'.
        dw_f, dP_f, dt_f = lF * (w - w_f), lF * (momentum_columns(w, q) - P_f), lF * (torque - t_f)
        Yf = regressor(dw_f, P_f)
        eps = times(Yf, theta_hat) - t_f  # (4.8), (4.9)

        dtheta = -ga * (da * g + times(transpose(Y), e))  # (4.5)
        # (4.6) with erratum 15: -da ga Z g - ga Z Y^T e is Z theta_hat'.
        dg = ga * times(transpose(Yf), eps) - lf * g + times(Z, dtheta)
        dZ = ga * matrix_product(transpose(Yf), Yf) - lf * Z  # (4.7)

        changes = (dtheta, dg, dZ, dw_f, dP_f, dt_f)
        after = AdaptiveState(q, *(x + T * dx for x, dx in zip(state[1:], changes, strict=True)))
        signals = AdaptiveSignals(e, wd, theta_hat, eps, least_eigenvalue(Z))
        return after, TorqueCommand(torque), signals


def _nearer(measurement: Measurement, reference: Reference) -> Array:
    """Return the measured q or -q, whichever is nearer to the reference, (..., 4)."""
    return _on_path(measurement.attitude, reference.attitude)


def _on_path(q: Array, before: Array) -> Array:
    """Return q or -q, whichever is nearer to ``before``: a sensor may report either sign."""
    return np.where(dot(q, before) < 0.0, -q, q)


def _rate(q: Array, w: Array) -> Array:
    """Return J(q) w = q [0, w], (..., 4): twice the rate of change of q."""
    return multiply(q, pure(w))


def _along(q: Array, u: Array) -> Array:
    """Return J(q)^T u, (..., 3): the vector part of conj(q) u."""
    return multiply(conjugate(q), u)[..., 1:]
