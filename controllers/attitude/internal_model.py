"""Rejection of a sinusoidal disturbance of unknown frequency: PD+ with an adaptive internal model.

The disturbance on axis k of the body is z1 = A cos(w_k t + phase), with unknown A, w_k and phase:

    z1' = phi z2,  z2' = -z1,  phi = w_k^2,  z2 = -A/w_k sin(w_k t + phase).

It is estimated as the vibration of a motor is in Servín 2022 (paper 001), (4.20)-(4.22), with the
bus's inertia M in place of a rotor's and time in place of its angle; the attitude law is (3.7):

    M w^' = -w x M w + tau + z1^ + b^ - ko (w^ - w)
    z1^' = phi^ z2^ - ke (w^ - w),  z2^' = -z1^,  b^' = -kb (w^ - w)
    phi^' = -ka z2^ (z1^ + b^ - z),  z = M w' + w x M w - tau,  tau = (3.7) - z1^ - b^

Without b, V = ke w~ M w~ / 2 + (|z1~|^2 + phi |z2~|^2)/2 + |phi~|^2/(2 ka) falls at ke ko |w~|^2,
whatever the attitude does, which (3.7) then brings to its reference; the paper feeds the tracking
error back to z1^ as well, here the start of a large slew would then be taken for a disturbance. A
bias b is beyond this argument, since phi's adaptation sees the error of b too. z holds an
acceleration; over a period its integral is the change of w, as in ``motors.motor_loops``.

Adaptive internal models: R. Marino, P. Tomei, "Output regulation for linear systems via adaptive
internal model", IEEE Transactions on Automatic Control 48 (2003).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross, times
from mjspace.contract import Array, Gains, Measurement, Reference, TorqueCommand, Unit, gain

from . import pd_plus

_TINY = 1e-12  # added to phi, far below any estimate: sin(sqrt(phi) T) / sqrt(phi) is regular


class State(NamedTuple):
    """Memory of the law: estimates, and what was measured and commanded last; each (..., 3)."""

    rate_hat: Annotated[Array, Unit("rad/s")]
    z1_hat: Annotated[Array, Unit("N m")]
    z2_hat: Annotated[Array, Unit("N m s/rad")]
    bias_hat: Annotated[Array, Unit("N m")]
    phi_hat: Annotated[Array, Unit("rad^2/s^2")]
    rate: Annotated[Array, Unit("rad/s")]
    torque: Annotated[Array, Unit("N m")]


class Signals(NamedTuple):
    """Signals of the law, body axes."""

    sigma_e: Array
    """Attitude error, modified Rodrigues parameters, (..., 3)."""
    s: Array
    """Composite error [rad/s], (..., 3)."""
    disturbance_hat: Annotated[Array, Unit("N m")]
    """Estimated disturbance [N m], (..., 3)."""
    frequency_hat: Annotated[Array, Unit("rad/s")]
    """Estimated frequency of the disturbance on each axis [rad/s], (..., 3)."""


@dataclass(frozen=True)
class InternalModel(Gains):
    """Modified PD+ with an adaptive internal model of the disturbance on each axis."""

    batched: ClassVar[bool] = True

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """M: of the rigid bus, about its centre of mass, body axes."""
    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    attitude_gain: float = gain("1/s", default=1.0, above=0.0)
    """lam: with s = 0, sigma_e vanishes at this rate."""
    rate_gain: float = gain("N m s/rad", default=10.0, above=0.0)
    """Kc, the same on each axis."""
    observer_gain: float = gain("N m s/rad", default=70.0, above=0.0)
    """ko."""
    model_gain: float = gain("N m/rad", default=100.0, above=0.0)
    """ke."""
    bias_gain: float = gain("N m/rad", default=0.0, at_least=0.0)
    """kb; zero: the disturbance has no mean."""
    adaptation_gain: float = gain(default=1000.0, at_least=0.0)
    """ka [1/(N m s)^2]; zero: the frequencies stay at ``frequency``."""
    frequency: float = gain("rad/s", default=0.0, at_least=0.0)
    """Initial estimate on each axis."""
    largest_frequency: float = gain("rad/s", default=2.0, above=0.0)
    """Largest estimate."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return no disturbance, and a torque under which the rate was constant until now."""
        w = measurement.rate
        z1, z2, bias = (np.zeros_like(w) for _ in range(3))
        phi = np.full_like(w, self.frequency**2)
        return State(w.copy(), z1, z2, bias, phi, w.copy(), cross(w, times(self.inertia, w)))

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, Signals]:
        """Return the estimates, the torque on the bus [N m], body axes, and the signals."""
        w = measurement.rate
        without, sigma_e, s = pd_plus.commanded_torque(
            measurement.attitude, w, times(self.inertia, w), reference, self.inertia, self._gains
        )
        rate_hat, z1, z2, bias, phi = self._observed(state, w)
        psi = np.sqrt(phi)
        angle = 0.5 * self.control_period * psi  # the torque is held for a period
        ahead = np.cos(angle) * z1 + np.sin(angle) * psi * z2
        torque = without - ahead - bias
        after = State(rate_hat, z1, z2, bias, phi, w.copy(), torque)
        return after, TorqueCommand(torque), Signals(sigma_e, s, z1 + bias, psi)

    def _observed(self, state: State, w: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Return rate_hat, z1_hat, z2_hat, bias_hat and phi_hat a period later, each (..., 3)."""
        T, M = self.control_period, self.inertia
        mean = 0.5 * (w + state.rate)
        drive = state.torque - cross(mean, times(M, mean))
        slip = state.rate_hat - state.rate
        psi = np.sqrt(state.phi_hat + _TINY)
        cos, sin = np.cos(psi * T), np.sin(psi * T)
        off = T * slip
        z1 = cos * state.z1_hat + psi * sin * state.z2_hat - self.model_gain * off
        z2 = cos * state.z2_hat - sin / psi * state.z1_hat
        bias = state.bias_hat - self.bias_gain * off
        mean_z = 0.5 * (z1 + state.z1_hat + bias + state.bias_hat)
        pushed = T * (drive + mean_z - self.observer_gain * slip)
        rate_hat = state.rate_hat + times(self._inverse, pushed)
        residual = T * (mean_z + drive) - times(M, w - state.rate)
        mean_z2 = 0.5 * (z2 + state.z2_hat)
        phi = state.phi_hat - self.adaptation_gain * mean_z2 * residual
        return rate_hat, z1, z2, bias, np.clip(phi, 0.0, self.largest_frequency**2)

    @cached_property
    def _inverse(self) -> Array:
        return np.asarray(np.linalg.inv(self.inertia))

    @cached_property
    def _gains(self) -> Array:
        return np.array([self.attitude_gain, self.rate_gain, 0.0, 1.0])
