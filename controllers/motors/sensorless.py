"""Sensorless observer: a motor's angle and speed from its currents and voltages alone.

An extended observer of the winding currents and of the back-EMF, which rotates with the rotor. A
phase-locked loop extracts angle and speed from the back-EMF and estimates the unknown part of the
acceleration. As complex numbers in the stator's axes, with Servín 2022 (paper 001), (2.68), (2.69),

    L i' = -R i + u - e,    e = j k_m W exp(j p theta).

Over a step the voltage is constant in these axes, and the back-EMF rotates.

The paper leaves speed control without a mechanical sensor to future work; the observer is not from
it. A rotor at rest has no back-EMF: the observer is for spinning wheels, not for gimbals.
"""

from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.gufunc import gufunc


@dataclass(frozen=True)
class SpeedObserver:
    """Observer of m motors.

    A gain is (m,), or one number for all motors where another gain determines m.
    """

    pole_pairs: Array | float
    """p."""
    resistance: Array | float
    """R [ohm]."""
    inductance: Array | float
    """L [H]."""
    torque_constant: Array | float
    """k_m [N m/A]."""
    period: float
    """Time from one step to the next [s]."""
    bandwidth: Array | float = 3000.0
    """Of the observed back-EMF [rad/s]."""
    tracking_bandwidth: Array | float = 500.0
    """Of the phase-locked loop [rad/s]."""

    def __post_init__(self) -> None:
        for name in ("bandwidth", "tracking_bandwidth"):
            if not np.all(np.asarray(getattr(self, name)) > 0.0):
                raise ValueError(
                    f"{name}: got {getattr(self, name)} rad/s, should be greater than zero"
                )

    def reset(self, speed: Array) -> Array:
        """Return the initial memory (..., m, 7) for a ``speed`` (..., m) [rad/s], at angle zero.

        Its columns: the two winding currents [A], the two components of the back-EMF [V], the
        electrical angle p theta in [-pi, pi) [rad], the rotor's speed [rad/s], and the unknown part
        of its acceleration [rad/s^2]. ``speed`` must have the right sign.
        """
        zero = np.zeros(speed.shape)
        emf = np.broadcast_to(self.torque_constant * speed, speed.shape)
        return np.stack([zero, zero, zero, emf, zero, speed, zero], axis=-1)

    def step(self, memory: Array, current: Array, voltage: Array, acceleration: Array) -> Array:
        """Return the memory (..., m, 7) at this instant.

        ``current`` (..., m, 2) [A] is measured in the windings now; ``voltage`` (..., m, 2) [V] was
        held on them since the last step; both are in the stator's axes (a, b). ``acceleration``
        (..., m) [rad/s^2] is the known part of the rotor's, for example k_m I_q / J.
        """
        after: Array = _observe.ufunc(memory, current, voltage, acceleration, self._gains)
        return after

    @cached_property
    def _gains(self) -> Array:
        R, L, T = np.asarray(self.resistance), np.asarray(self.inductance), self.period
        a = np.exp(-T * R / L)
        b = (1.0 - a) / R
        # Multiple poles: fast for currents and back-EMF, slower for angle and speed.
        d, c = (np.exp(-T * np.asarray(w)) for w in (self.bandwidth, self.tracking_bandwidth))
        rows = (self.pole_pairs, a, b, T, R, L)
        corrections = (1.0 - d * d / a, (1.0 - d) ** 2 / b)
        tracking = (1.0 - c**3, 1.5 * (1.0 - c) ** 2 * (1.0 + c) / T, (1.0 - c) ** 3 / T**2)
        columns = np.broadcast_arrays(*(np.atleast_1d(v) for v in (*rows, *corrections, *tracking)))
        return np.stack(columns).astype(float)


def turned(vector: Array, angle: Array) -> Array:
    """Return currents or voltages (..., m, 2) rotated by an ``angle`` (..., m) [rad]."""
    rotated: Array = _turned.ufunc(vector, angle)
    return rotated


def held_in_stator(voltage: Array, angle: Array, swept: Array, limit: float = inf) -> Array:
    """Return constant winding voltages (..., m, 2) [V] with the mean of one that rotates.

    ``voltage`` (..., m, 2) [V] is desired in the rotor's axes. These are at the electrical
    ``angle`` (..., m) [rad] now and ``swept`` (..., m) [rad] further at the end of the period. The
    result is along ``voltage`` at mid-period; it is lengthened so that its mean in the rotor's axes
    is right, up to the supply's ``limit`` [V].
    """
    after: Array = _held.ufunc(voltage, angle, swept, limit)
    return after


@gufunc(["void(f8[:,:],f8[:],f8[:,:])"], "(m,k),(m)->(m,k)")
def _turned(vector: Any, angle: Any, after: Any) -> None:
    for n in range(angle.size):
        turn = complex(np.cos(angle[n]), np.sin(angle[n]))
        there = complex(vector[n, 0], vector[n, 1]) * turn
        after[n, 0], after[n, 1] = there.real, there.imag


@gufunc(["void(f8[:,:],f8[:],f8[:],f8,f8[:,:])"], "(m,k),(m),(m),()->(m,k)")
def _held(voltage: Any, angle: Any, swept: Any, limit: Any, after: Any) -> None:
    for n in range(angle.size):
        half = 0.5 * swept[n]
        longer = half / np.sin(half) if half != 0.0 else 1.0
        length = longer * np.hypot(voltage[n, 0], voltage[n, 1])
        if length > limit:
            longer *= limit / length
        middle = complex(np.cos(angle[n] + half), np.sin(angle[n] + half))
        there = complex(voltage[n, 0], voltage[n, 1]) * middle * longer
        after[n, 0], after[n, 1] = there.real, there.imag


@gufunc(
    ["void(f8[:,:],f8[:,:],f8[:,:],f8[:],f8[:,:],f8[:,:])"], "(m,s),(m,k),(m,k),(m),(g,m)->(m,s)"
)
def _observe(
    memory: Any, current: Any, voltage: Any, acceleration: Any, gains: Any, after: Any
) -> None:
    """Predict over the last period, then correct by the measured current."""
    for n in range(memory.shape[0]):
        p, a, b, period = gains[0, n], gains[1, n], gains[2, n], gains[3, n]
        R, L = gains[4, n], gains[5, n]
        i = complex(memory[n, 0], memory[n, 1])
        e = complex(memory[n, 2], memory[n, 3])
        angle, unknown = memory[n, 4], memory[n, 6]
        grown = period * (acceleration[n] + unknown)
        speed = memory[n, 5] + 0.5 * grown  # in the middle of the period

        swept = p * speed * period
        turn = complex(np.cos(swept), np.sin(swept))
        i = a * i + b * complex(voltage[n, 0], voltage[n, 1])
        i -= e * (turn - a) / complex(R, p * speed * L)  # constant voltage, rotating back-EMF
        e = e * turn
        sure = abs(speed) > abs(grown)
        e *= 1.0 + (grown if sure else 0.0) / (speed if sure else 1.0)  # as the speed grows
        angle += swept
        speed += 0.5 * grown

        missed = complex(current[n, 0], current[n, 1]) - i
        i += gains[6, n] * missed
        e -= gains[7, n] * missed

        # e = j k_m W exp(j angle): its part along exp(j angle) measures the angle's error.
        cos, sin = np.cos(angle), np.sin(angle)
        along, across = e.real * cos + e.imag * sin, e.imag * cos - e.real * sin
        ahead = -np.arctan2(along, across) if speed > 0.0 else -np.arctan2(-along, -across)
        angle += gains[8, n] * ahead
        speed += gains[9, n] * ahead / p
        unknown += gains[10, n] * ahead / p
        angle -= 2.0 * np.pi * np.floor(angle / (2.0 * np.pi) + 0.5)
        after[n, 0], after[n, 1], after[n, 2], after[n, 3] = i.real, i.imag, e.real, e.imag
        after[n, 4], after[n, 5], after[n, 6] = angle, speed, unknown
