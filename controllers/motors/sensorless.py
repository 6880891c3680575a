"""A motor's angle and speed from its currents and voltages alone, for motors that turn.

An extended observer: the back-EMF is a state that turns with the rotor, beside the winding currents
that it drives; a phase-locked loop reads angle and speed from it, and has as a state of its own the
acceleration that nobody told it of. As complex numbers in the stator's axes, with Servín 2022
(paper 001), (2.68), (2.69),

    L i' = -R i + u - e,    e = j k_m W exp(j p theta).

From step to step the voltage is held in these axes, and the back-EMF turns on.

The paper leaves speed control without a mechanical sensor to later work; this observer is ours. A
rotor at rest has no back-EMF: it is for wheels that spin, not for gimbals.
"""

from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Any

import numpy as np
from numba import guvectorize

from mjspace.contract import Array


@dataclass(frozen=True)
class SpeedObserver:
    """Observes m motors at once; gains (m,) or one number for all where another gives m."""

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
                raise ValueError(f"{name} is {getattr(self, name)} rad/s: more than zero would do")

    def reset(self, speed: Array) -> Array:
        """Return the memory (..., m, 7) that believes a ``speed`` (..., m) and an angle of zero.

        Its columns: the winding currents [A], the back-EMF [V], the electrical angle p theta [rad],
        in [-pi, pi), the rotor's speed [rad/s] and its untold acceleration [rad/s^2]. The speed
        must have the right sign.
        """
        zero = np.zeros(speed.shape)
        emf = np.broadcast_to(self.torque_constant * speed, speed.shape)
        return np.stack([zero, zero, zero, emf, zero, speed, zero], axis=-1)

    def step(self, memory: Array, current: Array, voltage: Array, acceleration: Array) -> Array:
        """Return the memory (..., m, 7) as of now.

        ``current`` (..., m, 2) is measured in the windings now [A], ``voltage`` (..., m, 2) was
        held on them since the last step [V]; both in the stator's axes (a, b).
        ``acceleration`` (..., m) is what is known of the rotor's, k_m I_q / J for one [rad/s^2].
        """
        after: Array = _observe.ufunc(memory, current, voltage, acceleration, self._gains)
        return after

    @cached_property
    def _gains(self) -> Array:
        R, L, T = np.asarray(self.resistance), np.asarray(self.inductance), self.period
        a = np.exp(-T * R / L)
        b = (1.0 - a) / R
        # The poles of each error at one place: quick for the currents, slower for the angle.
        d, c = (np.exp(-T * np.asarray(w)) for w in (self.bandwidth, self.tracking_bandwidth))
        rows = (self.pole_pairs, a, b, T, R, L)
        corrections = (1.0 - d * d / a, (1.0 - d) ** 2 / b)
        tracking = (1.0 - c**3, 1.5 * (1.0 - c) ** 2 * (1.0 + c) / T, (1.0 - c) ** 3 / T**2)
        columns = np.broadcast_arrays(*(np.atleast_1d(v) for v in (*rows, *corrections, *tracking)))
        return np.stack(columns).astype(float)


def turned(vector: Array, angle: Array) -> Array:
    """Return currents or voltages (..., m, 2) turned by an ``angle`` (..., m) [rad]."""
    after: Array = _turned.ufunc(vector, angle)
    return after


def held_in_stator(voltage: Array, angle: Array, swept: Array, limit: float = inf) -> Array:
    """Return the windings' voltages (..., m, 2) that stand for one that turns with the rotor.

    ``voltage`` (..., m, 2) is wanted in the rotor's axes, which are at the electrical ``angle``
    (..., m) [rad] now and will be ``swept`` (..., m) further when the period ends: held in the
    stator's axes at their middle, and as much longer as its mean in theirs would be too short; no
    longer than the supply's ``limit`` [V].
    """
    after: Array = _held.ufunc(voltage, angle, swept, limit)
    return after


@guvectorize(["void(f8[:,:],f8[:],f8[:,:])"], "(m,k),(m)->(m,k)", cache=True)
def _turned(vector: Any, angle: Any, after: Any) -> None:
    for n in range(angle.size):
        turn = complex(np.cos(angle[n]), np.sin(angle[n]))
        there = complex(vector[n, 0], vector[n, 1]) * turn
        after[n, 0], after[n, 1] = there.real, there.imag


@guvectorize(["void(f8[:,:],f8[:],f8[:],f8,f8[:,:])"], "(m,k),(m),(m),()->(m,k)", cache=True)
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


@guvectorize(
    ["void(f8[:,:],f8[:,:],f8[:,:],f8[:],f8[:,:],f8[:,:])"],
    "(m,s),(m,k),(m,k),(m),(g,m)->(m,s)",
    cache=True,
)
def _observe(
    memory: Any, current: Any, voltage: Any, acceleration: Any, gains: Any, after: Any
) -> None:
    """Predict over the last period, then correct by what is measured now."""
    for n in range(memory.shape[0]):
        p, a, b, period = gains[0, n], gains[1, n], gains[2, n], gains[3, n]
        R, L = gains[4, n], gains[5, n]
        i = complex(memory[n, 0], memory[n, 1])
        e = complex(memory[n, 2], memory[n, 3])
        angle, untold = memory[n, 4], memory[n, 6]
        grown = period * (acceleration[n] + untold)
        speed = memory[n, 5] + 0.5 * grown  # in the middle of the period

        swept = p * speed * period
        turn = complex(np.cos(swept), np.sin(swept))
        i = a * i + b * complex(voltage[n, 0], voltage[n, 1])
        i -= e * (turn - a) / complex(R, p * speed * L)  # the voltage is held, the back-EMF turns
        e = e * turn
        sure = abs(speed) > abs(grown)
        e *= 1.0 + (grown if sure else 0.0) / (speed if sure else 1.0)  # as the speed grows
        angle += swept
        speed += 0.5 * grown

        missed = complex(current[n, 0], current[n, 1]) - i
        i += gains[6, n] * missed
        e -= gains[7, n] * missed

        # e = j k_m W exp(j angle): its part along exp(j angle) shows the angle's error.
        cos, sin = np.cos(angle), np.sin(angle)
        along, across = e.real * cos + e.imag * sin, e.imag * cos - e.real * sin
        ahead = -np.arctan2(along, across) if speed > 0.0 else -np.arctan2(-along, -across)
        angle += gains[8, n] * ahead
        speed += gains[9, n] * ahead / p
        untold += gains[10, n] * ahead / p
        angle -= 2.0 * np.pi * np.floor(angle / (2.0 * np.pi) + 0.5)
        after[n, 0], after[n, 1], after[n, 2], after[n, 3] = i.real, i.imag, e.real, e.imag
        after[n, 4], after[n, 5], after[n, 6] = angle, speed, untold
