"""Current and speed loops of synchronous motors, with adaptive rejection of a vibration.

Servín 2022 (paper 001), chapter 4, for m motors at once: shapes (..., m), gains (m,) or one number
for all where another gives m. Both loops are pure functions of what they remember and measure,
called once a period.

Where this differs from the paper, and why:

- Its equations are continuous. A symplectic Euler step on what is measured at a period's start
  leaves 1.6e-6 rad/s on the bench of chapter 4; here the internal model turns exactly by the angle
  the rotor turned, driven by the mean of the measurements at both ends: 3e-8 rad/s.
- (4.34) and (4.35) are two forms of one sum, whose terms of ka J W^2 z2 / 2, up to 150, cancel in
  the other form, in which no acceleration occurs either: phi_hat changes by
  -ka W z2_hat [T (z1_hat + k_m I_q) - J (W after - W before)]. It has erratum E15, z2_hat for z2's
  error, and is kept where a vibration can be: between 0 and ``ratio_limit``.
- I_q is the measured current, and the vibration is fed back ``lead`` ahead, by when the current
  will have followed: the current loop lags by 1/k_ep.
- What carries the motor may turn about the rotor's axis. Torques change the rotor's speed together
  with that, W = speed + ``carried``; the vibration and the back-EMF go with the speed alone.
- ``load`` and ``integral_gain`` are ours: a motor that holds a gyroscopic torque h x (rate) needs
  one of them, or k_p far above h.
"""

from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import Array

from . import motor_kernels as kernels

_RK4 = 2.785  # largest |pole| times step on the real axis that RK4 damps
Gain = Array | float


class Estimates(NamedTuple):
    """What the speed loop believes; each of shape (..., m)."""

    speed_hat: Array
    """Observed speed [rad/s]."""
    z1_hat: Array
    """Observed vibration, a torque on the rotor [N m]."""
    z2_hat: Array
    """Its companion: the vibration is z1 = A cos(psi theta + Phi), z2 = -A/psi sin(...)."""
    phi_hat: Array
    """Estimate of psi^2, psi being the vibration's cycles in a turn (erratum E16)."""


@dataclass(frozen=True)
class CurrentLoop:
    """Voltages for wanted currents: a PI with decoupling and back-EMF, (4.36), (4.37), I_d* = 0.

    With k_ei = k_ep R/L the current follows as 1/(1 + s/k_ep). A period in which the rotor's
    electrical angle turns p W T above about 1 rad is too long for the decoupling.
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
    """k_ep [1/s]; 0.3 to 0.6 of a period's inverse does well."""
    integral_gain: Gain | None = None
    """k_ei [1/s^2]; k_ep R/L when left out."""
    voltage_limit: Gain = inf
    """Of the supply [V]: beyond it the integrals hold."""

    def __post_init__(self) -> None:
        for name in ("resistance", "inductance", "torque_constant", "period", "proportional_gain"):
            _require_positive(name, getattr(self, name))
        kep, kei = self._gains[3:5]
        decay = np.broadcast_to(np.asarray(self.resistance) / self.inductance, kep.shape)
        refuse_fast_poles(kep, kei, decay, self.period)

    def reset(self, speed: Array) -> Array:
        """Return integrals of zero [A s], shape (..., m, 2), for motors at ``speed`` (..., m)."""
        return np.zeros((*speed.shape, 2))

    def step(
        self, integral: Array, current: Array, wanted: Array, speed: Array
    ) -> tuple[Array, Array]:
        """Return (integral, voltage), both (..., m, 2).

        ``current`` (..., m, 2) is the measured (I_d, I_q) [A], ``wanted`` (..., m) the wanted I_q
        [A], ``speed`` (..., m) the rotor's relative to its stator [rad/s]; ``voltage`` is
        (u_d, u_q) [V], not cut to the limit, so that a log shows what was asked.
        """
        given: tuple[Array, Array] = kernels.current_loop.ufunc(
            integral, current, wanted, speed, self._gains
        )
        return given

    @cached_property
    def _gains(self) -> Array:
        kep = np.asarray(self.proportional_gain, dtype=float)
        kei = kep * self.resistance / self.inductance
        if self.integral_gain is not None:
            kei = np.asarray(self.integral_gain, dtype=float)
        motor = (self.pole_pairs, self.inductance, self.torque_constant)
        return _stacked(*motor, kep, kei, self.voltage_limit, self.period)


@dataclass(frozen=True)
class SpeedLoop:
    """Currents for wanted speeds, (4.11) or (4.19), with the vibration's observer.

    Without ``vibration_gain`` there is no observer: (4.11) less z1_hat. Without ``adaptation_gain``
    it knows psi^2 to be ``ratio``, (4.8)-(4.10); with it, it learns psi^2, (4.19)-(4.22).
    """

    inertia: Gain
    """J that the motor turns [kg m^2]: what the rotor carries included (erratum E19)."""
    torque_constant: Gain
    """k_m [N m/A]."""
    period: float
    """Time from one step to the next [s]."""
    speed_gain: Gain
    """k_p [N m s/rad]."""
    integral_gain: Gain = 0.0
    """k_i [N m/rad], ours."""
    observer_gain: Gain = 0.0
    """k_o [N m s/rad]."""
    vibration_gain: Gain = 0.0
    """k_e [N m/rad]; zero: no observer."""
    adaptation_gain: Gain = 0.0
    """k_a [1/(N m)^2]."""
    lead: Gain = 0.0
    """How far ahead the vibration is fed back [s]: 1/k_ep, and half of what this period is longer
    than the current loop's; without a current loop half the period."""
    ratio: Gain = 0.0
    """psi^2 to start from."""
    ratio_limit: Gain = 1.5
    """Largest psi^2."""
    vibration_limit: Gain = inf
    """Largest amplitude that is believed [N m]: what the rejection does to the loop is no more."""
    current_limit: Gain = inf
    """Largest wanted |I_q| [A]; beyond it the integral holds."""

    def __post_init__(self) -> None:
        for name in ("inertia", "torque_constant", "period", "speed_gain", "current_limit"):
            _require_positive(name, getattr(self, name))
        pole = np.max(np.asarray(self.speed_gain) / self.inertia)
        if pole * self.period >= 2.0:
            raise ValueError(
                f"speed_gain puts a pole at {pole:.2g} rad/s: a period of {self.period:g} s is too "
                f"long, less than {2.0 / pole:.2g} s would do"
            )

    def reset(self, speed: Array, carried: Array | None = None) -> Array:
        """Return the memory (..., m, 9) that believes the speed and no vibration.

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
        wanted: Array,
        acceleration: Array,
        load: Array,
        carried: Array | None = None,
    ) -> tuple[Array, Array]:
        """Return (memory (..., m, 9), wanted I_q (..., m) [A]).

        ``current`` (..., m, 2) and ``speed`` (..., m), relative to what carries the motor, are
        measured [A, rad/s]; ``carried`` (..., m) is how fast that turns about the motor's axis, not
        at all when left out. ``wanted`` (..., m) is the wanted sum of both now [rad/s],
        ``acceleration`` (..., m) its derivative by when the current will have followed [rad/s^2],
        and ``load`` (..., m) the torque that the motor has to give besides, before the vibration
        [N m].
        """
        carried = np.zeros_like(speed) if carried is None else carried
        given: tuple[Array, Array] = kernels.speed_loop.ufunc(
            memory, current, speed, carried, wanted, acceleration, load, self._gains
        )
        return given

    @cached_property
    def _gains(self) -> Array:
        control = (self.inertia, self.torque_constant, self.speed_gain, self.integral_gain)
        observer = (self.observer_gain, self.vibration_gain, self.adaptation_gain, self.lead)
        limits = (self.ratio_limit, self.vibration_limit, self.current_limit)
        return _stacked(*control, *observer, *limits, self.period)


def estimates(memory: Array) -> Estimates:
    """Return what a speed loop's memory (..., m, 9) holds of the motion and the vibration.

    Before these it holds the last measured W, the last k_m I_q less the load, and the integral of
    the speed's error; after them the last measured speed, and the current that was wanted.
    """
    return Estimates(*(memory[..., column].copy() for column in range(3, 7)))


def held_current(memory: Array) -> Array:
    """Return the I_q (..., m) [A] that was wanted last, for a current loop that is called more."""
    return memory[..., 8]


def refuse_fast_poles(kep: Gain, kei: Gain, decay: Gain, period: float) -> None:
    """Refuse the current gains that a control ``period`` [s] cannot bear.

    ``kep`` [1/s], ``kei`` [1/s^2] and ``decay`` R/L [1/s] have one shape. With the voltage held,
    z^2 - (1 + a - b k_ep) z + a - b k_ep + b k_ei T has the loop's poles, a = exp(-T R/L) and
    b = (1 - a) L/R.

    Raises:
        ValueError: one is not within the unit circle. Erratum E21: the printed 9e6 and 5e6 1/s ask
            for steps of 3.1e-7 and 5.6e-7 s.
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
            f"period of {period:g} s is too long, one of {2.0 / fastest:.1e} s would do (and a "
            f"simulation by RK4 would need steps of {_RK4 / fastest:.1e} s); or try "
            f"{0.3 / period:g} 1/s"
        )


def _stacked(*values: Any) -> Array:
    """Return one row for each value, one column for each motor."""
    columns = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, dtype=float)) for v in values))
    return np.stack(columns)


def _require_positive(name: str, value: Gain) -> None:
    if not np.all(np.asarray(value) > 0.0):
        raise ValueError(f"{name} is {value}: more than zero would do")
