"""Current and speed loops of synchronous motors, with adaptive rejection of a vibration.

Servín 2022 (paper 001), chapter 4, for m motors at once: shapes (..., m). A gain is (m,), or one
number for all motors where another gain determines m. Both loops are pure functions of their memory
and the measurements, called once a period.

Differences from the paper:

- Its equations are continuous in time. With a symplectic Euler step from the measurements at the
  start of a period the error on the bench of chapter 4 is 1.6e-6 rad/s. Here the internal model
  rotates by exactly the rotor's angle, driven by the mean of the measurements at both ends of the
  period: 3e-8 rad/s.
- (4.34) and (4.35) are combined to one update, in which the terms ka J W^2 z2 / 2 (up to 150)
  cancel and no acceleration occurs: phi_hat changes by
  -ka W z2_hat [T (z1_hat + k_m I_q) - J (W after - W before)]. It includes erratum E15 (z2_hat
  instead of the error of z2) and is clipped to physical values, from 0 to ``ratio_limit``.
- I_q is the measured current. The vibration is fed back as predicted ``lead`` ahead, since the
  current loop lags by 1/k_ep.
- The carrier of the motor may rotate about the rotor's axis. Torques change the absolute speed
  W = speed + ``carried``; vibration and back-EMF depend on the relative speed alone.
- ``load`` and ``integral_gain`` are not in the paper: a motor that holds a gyroscopic torque
  h x (rate) needs one of them, or k_p far above h.
"""

from dataclasses import dataclass
from functools import cached_property, partial
from math import inf
from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import Array

_TINY = 1e-12  # added to psi^2, far below any estimate: sin(psi x) / psi is regular
_RK4 = 2.785  # largest |pole| times step on the real axis that RK4 damps
Gain = Array | float


class Estimates(NamedTuple):
    """Estimates of the speed loop, each of shape (..., m)."""

    speed_hat: Array
    """Estimated speed W [rad/s]."""
    z1_hat: Array
    """Estimated vibration torque on the rotor [N m], z1 = A cos(psi theta + Phi)."""
    z2_hat: Array
    """Estimate of z2 = -A/psi sin(psi theta + Phi) [N m]."""
    phi_hat: Array
    """Estimate of psi^2; psi is the vibration's cycles per revolution (erratum E16)."""


@dataclass(frozen=True)
class CurrentLoop:
    """Voltages for desired currents: PI with decoupling and back-EMF, (4.36), (4.37), I_d* = 0.

    With k_ei = k_ep R/L the closed loop is 1/(1 + s/k_ep). The decoupling needs a period T in which
    the electrical angle changes by p W T of less than about 1 rad.
    """

    pole_pairs: Gain
    """p."""
    resistance: Gain
    """R [ohm]."""
    inductance: Gain
    """L [H]."""
    torque_constant: Gain
    """k_m [N m/A]."""
    period: float
    """Time from one step to the next [s]."""
    proportional_gain: Gain = 3000.0
    """k_ep [1/s]; good values are 0.3 to 0.6 of the inverse of the period."""
    integral_gain: Gain | None = None
    """k_ei [1/s^2]; default k_ep R/L."""
    voltage_limit: Gain = inf
    """Of the supply [V]: beyond it the integrals hold."""

    def __post_init__(self) -> None:
        for name in ("resistance", "inductance", "torque_constant", "period", "proportional_gain"):
            _require_positive(name, getattr(self, name))
        decay = np.asarray(self.resistance) / self.inductance
        kep, kei, decay = np.broadcast_arrays(self.proportional_gain, self._kei, decay)
        refuse_fast_poles(kep, kei, decay, self.period)

    def reset(self, speed: Array) -> Array:
        """Return integrals of zero [A s], shape (..., m, 2), for motors at ``speed`` (..., m)."""
        return np.zeros((*speed.shape, 2))

    def step(
        self, integral: Array, current: Array, desired: Array, speed: Array
    ) -> tuple[Array, Array]:
        """Return (integral, voltage), both (..., m, 2).

        ``current`` (..., m, 2) is the measured (I_d, I_q) [A], ``desired`` (..., m) the desired I_q
        [A], ``speed`` (..., m) the speed of the rotor relative to its stator [rad/s]. ``voltage``
        is the commanded (u_d, u_q) [V]; it is not limited to the supply's.
        """
        L, km, kep, kei = self.inductance, self.torque_constant, self.proportional_gain, self._kei
        I_d, I_q = current[..., 0], current[..., 1]
        error_d, error_q = I_d, I_q - desired
        electrical = self.pole_pairs * speed
        u_d = L * (-electrical * I_q - kep * error_d - kei * integral[..., 0])  # (4.36)
        u_q = L * (electrical * I_d - kep * error_q - kei * integral[..., 1]) + km * speed  # (4.37)
        # Anti-windup: beyond the supply's limit the integrals hold.
        grown = np.where(np.hypot(u_d, u_q) > self.voltage_limit, 0.0, self.period)
        error = np.stack([error_d, error_q], axis=-1)
        return integral + grown[..., None] * error, np.stack([u_d, u_q], axis=-1)

    @property
    def _kei(self) -> Gain:
        if self.integral_gain is not None:
            return self.integral_gain
        return self.proportional_gain * self.resistance / self.inductance


@dataclass(frozen=True)
class SpeedLoop:
    """Currents for desired speeds, (4.11) or (4.19), with an observer of the vibration.

    Without ``vibration_gain`` there is no observer: (4.11) without z1_hat. Without
    ``adaptation_gain`` psi^2 stays at ``ratio``, (4.8)-(4.10); with it psi^2 is estimated,
    (4.19)-(4.22).
    """

    inertia: Gain
    """J: inertia that the motor turns [kg m^2], including what the rotor carries (erratum E19)."""
    torque_constant: Gain
    """k_m [N m/A]."""
    period: float
    """Time from one step to the next [s]."""
    speed_gain: Gain
    """k_p [N m s/rad]."""
    integral_gain: Gain = 0.0
    """k_i [N m/rad]; not in the paper."""
    observer_gain: Gain = 0.0
    """k_o [N m s/rad]."""
    vibration_gain: Gain = 0.0
    """k_e [N m/rad]; zero: no observer."""
    adaptation_gain: Gain = 0.0
    """k_a [1/(N m)^2]."""
    lead: Gain = 0.0
    """Prediction time of the vibration that is fed back [s]: 1/k_ep plus half the difference of
    this period to that of the current loop; without a current loop half the period."""
    ratio: Gain = 0.0
    """Initial psi^2."""
    clock: Gain = 0.0
    """Rate [rad/s] of a vibration that depends on time, (2.75): psi is then its frequency over this
    rate; zero: the vibration depends on the rotor's angle, (2.76)."""
    ratio_limit: Gain = 1.5
    """Largest psi^2."""
    vibration_limit: Gain = inf
    """Largest amplitude of the estimated vibration [N m]: bounds the torque of the rejection."""
    current_limit: Gain = inf
    """Largest commanded |I_q| [A]; beyond it the integral holds."""

    def __post_init__(self) -> None:
        for name in ("inertia", "torque_constant", "period", "speed_gain", "current_limit"):
            _require_positive(name, getattr(self, name))
        pole = np.max(np.asarray(self.speed_gain) / self.inertia)
        if pole * self.period >= 2.0:
            raise ValueError(
                f"speed_gain puts a pole at {pole:.2g} rad/s: a period of {self.period:g} s is too "
                f"long, it should be less than {2.0 / pole:.2g} s"
            )

    def reset(self, speed: Array, carried: Array | None = None) -> Array:
        """Return the initial memory (..., m, 9): the estimated speed is right, no vibration.

        ``speed`` and ``carried`` (..., m) are as in ``step``.
        """
        zero = np.zeros(speed.shape)
        W = speed if carried is None else speed + carried
        phi = np.broadcast_to(np.asarray(self.ratio, dtype=float), speed.shape)
        return np.stack([W, zero, zero, W, zero, zero, phi, speed, zero], axis=-1)

    def step(
        self,
        memory: Array,
        current: Array,
        speed: Array,
        desired: Array,
        acceleration: Array,
        load: Array,
        carried: Array | None = None,
    ) -> tuple[Array, Array]:
        """Return (memory (..., m, 9), commanded I_q (..., m) [A]).

        ``current`` (..., m, 2) [A] and ``speed`` (..., m) [rad/s], relative to the motor's carrier,
        are measured; ``carried`` (..., m) [rad/s] is the rate of the carrier about the motor's axis
        (default zero). ``desired`` (..., m) [rad/s] is the desired sum of both at this instant,
        ``acceleration`` (..., m) [rad/s^2] its derivative once the current has followed, and
        ``load`` (..., m) [N m] a known load torque that the motor has to hold in addition.
        """
        J, km, kp, ki = self.inertia, self.torque_constant, self.speed_gain, self.integral_gain
        W = speed if carried is None else speed + carried
        error = desired - W
        drive = km * current[..., 1] - load
        integral = memory[..., 2]
        W_hat, z1, z2, phi = self._observed(memory, W, speed, error, drive)

        psi = np.sqrt(phi)
        angle = psi * self._turning(speed) * self.lead
        ahead = np.cos(angle) * z1 + np.sin(angle) * psi * z2
        torque = J * acceleration + load + kp * error + ki * integral - ahead  # (4.19)
        unlimited = torque / km
        limited = np.clip(unlimited, -self.current_limit, self.current_limit)
        integral = integral + np.where(limited == unlimited, self.period, 0.0) * error
        return np.stack([W, drive, integral, W_hat, z1, z2, phi, speed, limited], axis=-1), limited

    def _observed(
        self, memory: Array, W: Array, speed: Array, error: Array, drive: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Return the estimates W, z1, z2 and psi^2 at this instant, each (..., m).

        From the last instant to this one with the means of both measurements: the internal model
        rotates by exactly the angle of the rotor.
        """
        J, T = self.inertia, self.period
        ko, ke, ka = self.observer_gain, self.vibration_gain, self.adaptation_gain
        before = [memory[..., column] for column in range(9)]
        W_before, drive_before, _, W_hat, z1_before, z2_before, phi, speed_before, _ = before
        if not np.any(self._observes):
            return W, z1_before, z2_before, phi
        mean_W = self._turning(0.5 * (speed + speed_before))
        mean_drive = 0.5 * (drive + drive_before)
        slip = W_hat - W_before
        psi = np.sqrt(phi + _TINY)
        turn = psi * mean_W * T
        cos, sin = np.cos(turn), np.sin(turn)
        z1 = cos * z1_before + psi * sin * z2_before - T * ke * (slip + error)  # (4.21)
        z2 = cos * z2_before - sin / psi * z1_before  # (4.22)
        mean_z1, mean_z2 = 0.5 * (z1 + z1_before), 0.5 * (z2 + z2_before)
        W_hat = W_hat + T * (mean_drive + mean_z1 - ko * slip) / J  # (4.20), erratum E14
        # (4.34) and (4.35), with erratum E15, summed by parts over the period.
        residual = T * (mean_z1 + mean_drive) - J * (W - W_before)
        phi = np.clip(phi - ka * mean_W * mean_z2 * residual, 0.0, self.ratio_limit)
        length = np.hypot(z1, np.sqrt(phi) * z2)
        beyond = length > self.vibration_limit  # both choices are computed: no division by zero
        share = np.where(beyond, self.vibration_limit, 1.0) / np.where(beyond, length, 1.0)
        found, initial = (W_hat, share * z1, share * z2, phi), (W, *before[4:7])
        chosen: Any = map(partial(np.where, self._observes), found, initial)
        return tuple(chosen)

    def _turning(self, speed: Array) -> Array:
        """Return how fast the internal model turns [rad/s], (..., m): as the rotor or a clock."""
        if not np.any(self.clock):
            return speed
        return np.where(np.asarray(self.clock) > 0.0, self.clock, speed)

    @cached_property
    def _observes(self) -> Any:
        return np.asarray(self.vibration_gain) > 0.0


def estimates(memory: Array) -> Estimates:
    """Return the estimates in a speed loop's memory (..., m, 9).

    Its columns: last measured W [rad/s], last k_m I_q less load [N m], integral of the speed error
    [rad], the four estimates, last measured speed [rad/s], last commanded current [A].
    """
    return Estimates(*(memory[..., column].copy() for column in range(3, 7)))


def held_current(memory: Array) -> Array:
    """Return the last commanded I_q (..., m) [A], for a current loop that runs at a higher rate."""
    return memory[..., 8]


def refuse_fast_poles(kep: Gain, kei: Gain, decay: Gain, period: float) -> None:
    """Refuse current gains that are unstable at a control ``period`` [s].

    ``kep`` [1/s], ``kei`` [1/s^2] and ``decay`` R/L [1/s] have equal shapes. With the voltage held
    over a period the poles are the roots of z^2 - (1 + a - b k_ep) z + a - b k_ep + b k_ei T, with
    a = exp(-T R/L) and b = (1 - a) L/R.

    Raises:
        ValueError: a pole is not inside the unit circle. Erratum E21: the printed 9e6 and 5e6 1/s
            need steps of 3.1e-7 and 5.6e-7 s.
    """
    for p, i, r in zip(*(np.ravel(v) for v in (kep, kei, decay)), strict=True):
        a = np.exp(-period * r)
        b = (1.0 - a) / r
        poles = np.roots([1.0, b * p - 1.0 - a, a - b * p + b * i * period])
        if np.all(np.abs(poles) < 1.0):
            continue
        fastest = np.max(np.abs(np.roots([1.0, r + p, i])))
        raise ValueError(
            f"current gains {p:g} 1/s and {i:g} 1/s^2 put a pole at {fastest:.2g} rad/s: a control "
            f"period of {period:g} s is too long, it should be at most {2.0 / fastest:.1e} s (and "
            f"the steps of RK4 at most {_RK4 / fastest:.1e} s); or use a "
            f"gain of {0.3 / period:g} 1/s"
        )


def _require_positive(name: str, value: Gain) -> None:
    if not np.all(np.asarray(value) > 0.0):
        raise ValueError(f"{name}: got {value}, should be greater than zero")
