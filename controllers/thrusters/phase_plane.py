"""On/off thrusters in the phase plane: angle a and rate a' of each axis decide how they fire.

R. Vázquez, "Tema 8: Control activo de la actitud", Universidad de Sevilla 2016 (paper 004), the
reaction-control slides. On each axis a'' = u with u = U, -U or zero, where U follows from thrusters
and inertia. Corrected: the initial conditions need a' (erratum 16), and the coasting line is
a - a_0 = t a'_0 (erratum 17). The axes are treated as independent, which holds to second order in
the angles. All arrays may have leading vehicle axes; m is the number of axes.
"""

from dataclasses import dataclass

import numpy as np

from mjspace.contract import TICK, Array, gain

from .relays import PhasePlane


@dataclass(frozen=True, kw_only=True)
class Centre(PhasePlane):
    """u = -U sgn(a): a neutral centre of period 4 sqrt(2 a_0 / U), no limit cycle (erratum 8).

    a'^2/2 + U |a| is constant; a delay tau in the loop adds 2 U tau |a'| to it at each switch.
    """

    def _decide(self, memory: Array, angle: Array, rate: Array) -> tuple[Array, Array, Array]:
        return self._whole(-np.sign(angle))


@dataclass(frozen=True, kw_only=True)
class Sliding(PhasePlane):
    """u = -U sgn(a + k a'): after a few switches the state slides as exp(-t/k) (erratum 9).

    Sliding occurs where |a'| <= k U. It switches at the rate of the loop and burns continuously.
    With a delay tau < k it ends in a limit cycle of a' = U tau (k - tau/2) / (k - tau).
    """

    rate_gain: float = gain("s", default=1.0, at_least=0.0)
    """k."""

    def _decide(self, memory: Array, angle: Array, rate: Array) -> tuple[Array, Array, Array]:
        return self._whole(-np.sign(angle + self.rate_gain * rate))


@dataclass(frozen=True, kw_only=True)
class MinimumTime(PhasePlane):
    """u = -U sgn(a + a' |a'| / 2U): reaches rest with one switch, from rest in 2 sqrt(a_0 / U).

    The thrusters are off where |a| is below ``dead_band`` and |a'| below the change of one
    integration step.
    """

    dead_band: float = gain("rad", default=1e-3, at_least=0.0)
    """Has to cover the error of a switch that is late by tau: twice tau times the peak rate."""

    def _decide(self, memory: Array, angle: Array, rate: Array) -> tuple[Array, Array, Array]:
        ahead = angle + rate * np.abs(rate) / (2.0 * self.acceleration)
        slow = np.abs(rate) <= self.acceleration * self.inner_period
        arrived = slow & (np.abs(angle) <= self.dead_band)
        return self._whole(np.where(arrived, 0.0, -np.sign(ahead)))


@dataclass(frozen=True, kw_only=True)
class MinimumFuel(PhasePlane):
    """Reaches rest at the target in a fixed time with least fuel: burn, coast, burn.

    The final time T is prescribed; the lecture calls it a minimum time (erratum 18). The burns are
    planned once. A burn that begins within an integration step has the right impulse but starts
    with the step. Memory: duration of the first burn [s] and of the second [s], the sense of the
    second, the time elapsed [s].
    """

    final_time: float = gain("s", above=0.0)
    """T: at least the minimum time."""

    def _recall(self, angle: Array, rate: Array) -> Array:
        U, T = self.acceleration, self.final_time
        ahead = angle + rate * np.abs(rate) / (2.0 * U)
        sense = np.where(ahead == 0.0, np.sign(rate), np.sign(ahead))
        a, v = sense * angle, sense * rate
        root = (U * T + v) ** 2 - 4.0 * U * (a + v * T + v**2 / (2.0 * U))
        first = (U * T + v - np.sqrt(np.maximum(root, 0.0))) / (2.0 * U)
        second = first - v / U
        if (root < 0.0).any() or (first < -TICK).any() or (second < -TICK).any():
            raise ValueError(
                f"final_time: got {T:g} s, no burn, coast and burn ends at rest in that time"
            )
        return np.stack([first, second, sense, np.zeros_like(first)], axis=-1)

    def _decide(self, memory: Array, angle: Array, rate: Array) -> tuple[Array, Array, Array]:
        first, second, sense, now = np.moveaxis(memory, -1, 0)
        later, end = now + self.inner_period, self.final_time
        burn = np.clip(np.minimum(later, first) - now, 0.0, None)
        brake = np.clip(np.minimum(later, end) - np.maximum(now, end - second), 0.0, None)
        duration = np.where(burn > TICK, burn, brake)
        firing = np.where(burn > TICK, -sense, np.where(brake > TICK, sense, 0.0))
        return np.stack([first, second, sense, later], axis=-1), firing, duration


@dataclass(frozen=True, kw_only=True)
class Schmitt(PhasePlane):
    """A Schmitt trigger on s = a + k a': on where |s| > delta, off where |s| < delta - hysteresis.

    It converges, slowly for large k, to a limit cycle with |a'| = hysteresis / 2k between pulses.
    Memory: the firing sense, 1, 0 or -1.
    """

    threshold: float = gain("rad", above=0.0)
    """delta."""
    hysteresis: float = gain("rad", above=0.0)
    rate_gain: float = gain("s", at_least=0.0)
    """k."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.hysteresis < self.threshold:
            raise ValueError(
                f"hysteresis: got {self.hysteresis:g} rad, should be less than threshold, "
                f"{self.threshold:g} rad"
            )

    def _decide(self, memory: Array, angle: Array, rate: Array) -> tuple[Array, Array, Array]:
        s, before = angle + self.rate_gain * rate, memory[..., 0]
        begins = np.abs(s) > self.threshold
        goes_on = -before * s > self.threshold - self.hysteresis
        return self._whole(np.where(begins, -np.sign(s), np.where(goes_on, before, 0.0)))


@dataclass(frozen=True, kw_only=True)
class MinimumImpulse(PhasePlane):
    """One pulse of fixed length at each exit from the dead zone: the least impulse to stay inside.

    A pulse changes the rate by dv = U times its length. Without a disturbance the limit cycle has
    two pulses in a period of 8 delta / dv and is neutral: it keeps its initial rates. With a
    constant disturbance d [rad/s^2] it is one-sided, with a pulse every dv / d; a ``rate_gain`` of
    dv / 2d then gives the least amplitude at once. Memory: the remaining time of the pulse [s],
    negative for one against the axis.
    """

    dead_zone: float = gain("rad", above=0.0)
    """delta."""
    pulse: float = gain("s", above=0.0)
    """Length of a pulse; at least the minimum on-time of the valves."""
    rate_gain: float = gain("s", default=0.0, at_least=0.0)
    """k: a + k a' is held within the dead zone."""

    def _decide(self, memory: Array, angle: Array, rate: Array) -> tuple[Array, Array, Array]:
        left, s = memory[..., 0], angle + self.rate_gain * rate
        leaves = (np.abs(s) >= self.dead_zone) & (s * rate > 0.0)
        idle = np.abs(left) <= TICK
        left = np.where(idle, np.where(leaves, -np.sign(s) * self.pulse, 0.0), left)
        duration = np.minimum(np.abs(left), self.inner_period)
        firing = np.sign(left)
        return (left - firing * duration)[..., None], firing, duration
