"""PD+ attitude tracking: classical, modified, and robust to a bounded disturbance.

J. Servín Aguilar, "Control de orientación para satélites con compensación de vibración", UNAM 2022
(paper 001), chapter 3. The attitude error sigma_e is in modified Rodrigues parameters (MRP), from
desired to body axes, of the set with |sigma_e| <= 1. Two signs of the printed (3.5) are wrong (E9):
for equal attitudes it gives 2 sigma / (1 - |sigma|^2). Here sigma_e is computed from quaternions,
so that q and -q are one attitude. The laws have no memory: at an error of 180 deg the sign of the
error changes, and with it the torque. All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross, dot, times
from mjspace.contract import Array, Gains, Measurement, Reference, TorqueCommand, gain

from .tracking_error import tracking_error
from .wheel_momentum import wheel_momentum


class State(NamedTuple):
    """Memory of these laws: empty."""


class ClassicalSignals(NamedTuple):
    """Signals of the classical law; the torque is the sum of the last two."""

    sigma_e: Array
    """Attitude error, MRP, (..., 3)."""
    w_e: Array
    """Measured less desired rate [rad/s], body axes, (..., 3)."""
    feedforward: Array
    """M R_e^T wd' + wb x M wb [N m], (..., 3)."""
    feedback: Array
    """-kp sigma_e - kv w_e [N m], (..., 3)."""


class ModifiedSignals(NamedTuple):
    """Signals of the modified law; the torque is the sum of the last two."""

    sigma_e: Array
    """Attitude error, MRP, (..., 3)."""
    s: Array
    """Composite error w_e + 2 lam sigma_e [rad/s], body axes, (..., 3)."""
    feedforward: Array
    """M wr' - H x wr [N m], (..., 3)."""
    feedback: Array
    """-(1 + |sigma_e|^2) sigma_e / 2 - Kc s [N m], (..., 3)."""


class RobustSignals(NamedTuple):
    """Signals of the robust law: those of the modified law, and the third part of the torque."""

    sigma_e: Array
    s: Array
    feedforward: Array
    feedback: Array
    compensation: Array
    """-tbar^2 s / (tbar |s| + eps), (3.19) [N m], (..., 3)."""


def commanded_torque(
    attitude: Array,
    rate: Array,
    momentum: Array,
    reference: Reference,
    inertia: Array,
    gains: Array,
) -> tuple[Array, Array, Array]:
    """Return the torque [N m] of (3.18) or (5.9), sigma_e and s [rad/s], each (..., 3), body axes.

    ``attitude`` (..., 4) and ``rate`` (..., 3) [rad/s] are measured. ``momentum`` (..., 3) [N m s],
    body axes, is M w of a rigid bus in chapter 3, or the total h with the wheels in chapter 5.
    ``inertia`` is (3, 3) [kg m^2]. ``gains`` is [lam, Kc, tbar, eps] with the units of ``Robust``;
    eps is above zero, and a tbar of zero makes it (3.7), without the disturbance term.
    """
    lam, kc, tbar, eps = gains
    sigma_e, s, feedforward, feedback = _modified(
        attitude, rate, momentum, reference, inertia, lam, kc
    )
    return feedforward + feedback + _compensation(s, tbar, eps), sigma_e, s


def _modified(
    attitude: Array,
    rate: Array,
    momentum: Array,
    reference: Reference,
    inertia: Array,
    lam: float,
    kc: float,
) -> tuple[Array, Array, Array, Array]:
    """Return sigma_e, s, the feedforward and the feedback of (3.7), each (..., 3)."""
    _, sigma_e, w_e, wb, dwd_b = tracking_error(attitude, rate, reference)  # (3.5), E9
    wr = wb - 2.0 * lam * sigma_e  # (3.8)
    s = w_e + 2.0 * lam * sigma_e
    square = dot(sigma_e, sigma_e)
    # G(sigma_e) w_e, twice the rate of sigma_e.
    G_w = 0.5 * (1.0 - square) * w_e + cross(sigma_e, w_e) + dot(sigma_e, w_e) * sigma_e
    dwr = dwd_b + cross(wb, w_e) - lam * G_w  # (3.9)
    feedforward = times(inertia, dwr) - cross(momentum, wr)  # (3.7)
    feedback = -0.5 * (1.0 + square) * sigma_e - kc * s
    return sigma_e, s, feedforward, feedback


def _compensation(s: Array, tbar: float, eps: float) -> Array:
    """Return (3.19), (..., 3)."""
    return -tbar * tbar / (tbar * np.sqrt(dot(s, s)) + eps) * s


@dataclass(frozen=True)
class Classical(Gains):
    """PD+: tau = M R_e^T wd' + wb x M wb - kp sigma_e - kv w_e, with wb = R_e^T wd.

    The thesis sets kp = wn^2 and kv = 2 wn with wn = 3.5 rad/s. Since sigma_e is a quarter of the
    angle, this would need 4 wn^2 M and 2 wn M. The actual loop has 0.5 rad/s and a damping ratio of
    0.6 (E26) and overshoots by 11.5 %.
    """

    batched: ClassVar[bool] = True

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """M: of the rigid bus, about its centre of mass, body axes."""
    attitude_gain: float = gain("N m", default=12.25, above=0.0)
    """kp, on the MRP: the stiffness per angle is a quarter of it."""
    rate_gain: float = gain("N m s/rad", default=7.0, above=0.0)
    """kv, the same on each axis."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the empty state."""
        return State()

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, ClassicalSignals]:
        """Return the torque, the errors and the parts of the torque."""
        M = self.inertia
        _, sigma_e, w_e, wb, dwd_b = tracking_error(
            measurement.attitude, measurement.rate, reference
        )
        feedforward = times(M, dwd_b) + cross(wb, times(M, wb))
        feedback = -self.attitude_gain * sigma_e - self.rate_gain * w_e
        signals = ClassicalSignals(sigma_e, w_e, feedforward, feedback)
        return state, TorqueCommand(feedforward + feedback), signals


@dataclass(frozen=True)
class _ModifiedGains(Gains):
    """What the modified and the robust law share."""

    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """M: of the rigid bus, about its centre of mass, body axes."""
    attitude_gain: float = gain("1/s", default=1.0, above=0.0)
    """lam: with s = 0, sigma_e vanishes at this rate."""
    rate_gain: float = gain("N m s/rad", default=10.0, above=0.0)
    """Kc, the same on each axis."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the empty state."""
        return State()

    def _parts(
        self, measurement: Measurement, momentum: Array, reference: Reference
    ) -> tuple[Array, Array, Array, Array]:
        """Return sigma_e, s, the feedforward and the feedback of (3.7), each (..., 3)."""
        gains = self.inertia, self.attitude_gain, self.rate_gain
        return _modified(measurement.attitude, measurement.rate, momentum, reference, *gains)


@dataclass(frozen=True)
class Modified(_ModifiedGains):
    """Modified PD+, (3.7): tau = M wr' - M w x wr - (1 + |sigma_e|^2) sigma_e / 2 - Kc s.

    wr = wb - 2 lam sigma_e and s = w - wr: both errors vanish exponentially (Lemma 3.1.1).
    """

    batched: ClassVar[bool] = True

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, ModifiedSignals]:
        """Return the torque, the errors and the parts of the torque."""
        momentum = times(self.inertia, measurement.rate)
        signals = ModifiedSignals(*self._parts(measurement, momentum, reference))
        return state, TorqueCommand(signals.feedforward + signals.feedback), signals


@dataclass(frozen=True)
class Robust(_ModifiedGains):
    """Modified PD+ with compensation of a disturbance with a known bound, (3.18).

    The third part, (3.19), is a smoothed relay: its slope at s = 0 is tbar^2 / eps, by default
    16000 N m s/rad, a pole at 1160 to 1540 rad/s on the thesis' bus. The loop chatters if its
    period is above twice the inertia over that slope, 1.3 ms there. The errors' ultimate bound is
    2.63 times the ball printed in Corollary 3.2.1 (E25).
    """

    batched: ClassVar[bool] = True

    disturbance_bound: float = gain("N m", default=0.04, above=0.0)
    """tbar: largest norm of the disturbance; the thesis' reaches 0.0387 (E24)."""
    smoothing: float = gain("W", default=1e-7, above=0.0)
    """eps: smoothing of the relay, which reduces the power that it takes from s by at most eps."""
    wheel_axes: Array = gain(shape=("wheel", 3), default=np.zeros((0, 3)), form="unit vector")
    """Unit spin axes of reaction wheels, body axes, one row for each; not in the thesis."""
    wheel_inertia: Array = gain("kg m^2", ("wheel",), default=(), at_least=0.0)
    """Axial inertia of each wheel, not contained in ``inertia``."""

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, RobustSignals]:
        """Return the torque, the errors and the parts of the torque."""
        momentum = times(self.inertia, measurement.rate) + wheel_momentum(self, measurement)
        parts = self._parts(measurement, momentum, reference)
        signals = RobustSignals(
            *parts, _compensation(parts[1], self.disturbance_bound, self.smoothing)
        )
        torque = signals.feedforward + signals.feedback + signals.compensation
        return state, TorqueCommand(torque), signals
