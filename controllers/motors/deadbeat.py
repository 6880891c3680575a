"""Deadbeat current loops of synchronous motors: the current is the desired one a period later.

The voltage is what the exact solution of (2.73), (2.74) of Servín 2022 (paper 001) needs over one
period; as complex numbers i = I_d + j I_q, with the speed W held,

    L i' = -(R + j p W) i + u - j k_m W,    i(T) = E i + F (u - j k_m W)/L,

E = exp(a T), F = (E - 1)/a, a = -R/L - j p W. The thesis leaves a better law than its PI to future
work. Deadbeat and predictive current control: H. Le-Huy, K. Slimani, P. Viarouge, "Analysis and
implementation of a real-time predictive current controller for permanent-magnet synchronous servo
drives", IEEE Transactions on Industrial Electronics 41 (1994). The integral is ours: what the
current is off, a period later, is a voltage that the model lacks.
"""

from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.gufunc import gufunc

from .motor_loops import Gain


@dataclass(frozen=True)
class DeadbeatLoop:
    """Voltages for desired currents I_q*, with I_d* = 0; called as ``motor_loops.CurrentLoop``.

    An inductance that is wrong by a factor k puts the pole at 1 - k: it oscillates above 1, and is
    unstable from about 2 on.
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
    correction: Gain = 0.1
    """Share of the voltage that was lacking which is added in each period."""
    voltage_limit: Gain = inf
    """Of the supply [V]: beyond it the integrals hold."""

    def reset(self, speed: Array) -> Array:
        """Return no correction [V] and no current [A], (..., m, 3), for motors at ``speed``."""
        return np.zeros((*speed.shape, 3))

    def step(
        self, memory: Array, current: Array, desired: Array, speed: Array
    ) -> tuple[Array, Array]:
        """Return (memory (..., m, 3), commanded voltage (u_d, u_q) [V], (..., m, 2)).

        ``current`` (..., m, 2) is the measured (I_d, I_q) [A], ``desired`` (..., m) the desired I_q
        [A], ``speed`` (..., m) the speed of the rotor relative to its stator [rad/s]. The memory
        holds the corrections (u_d, u_q) [V] and the last desired I_q [A].
        """
        after: tuple[Array, Array] = _aim.ufunc(memory, current, desired, speed, self._constants)
        return after

    @cached_property
    def _constants(self) -> Array:
        rows = (
            *(self.pole_pairs, self.resistance, self.inductance, self.torque_constant),
            *(self.period, self.correction, self.voltage_limit),
        )
        return np.stack(np.broadcast_arrays(*(np.atleast_1d(row) for row in rows))).astype(float)


@gufunc(
    ["void(f8[:,:],f8[:,:],f8[:],f8[:],f8[:,:],f8[:,:],f8[:,:])"],
    "(m,s),(m,k),(m),(m),(c,m)->(m,s),(m,k)",
)
def _aim(
    memory: Any, current: Any, desired: Any, speed: Any, constants: Any, after: Any, voltage: Any
) -> None:
    for n in range(speed.size):
        p, R, L, km = constants[0, n], constants[1, n], constants[2, n], constants[3, n]
        T, share, limit = constants[4, n], constants[5, n], constants[6, n]
        a = complex(-R / L, -p * speed[n])
        E = np.exp(a * T)
        per_ampere = L * a / (E - 1.0)  # L / F: volts for each ampere in a period
        here = complex(current[n, 0], current[n, 1])
        correction = complex(memory[n, 0], memory[n, 1])
        missed = share * per_ampere * (complex(0.0, memory[n, 2]) - here)
        u = complex(0.0, km * speed[n]) + per_ampere * (complex(0.0, desired[n]) - E * here)
        u += correction + missed
        beyond = abs(u) > limit
        kept = correction if beyond else correction + missed
        after[n, 0], after[n, 1], after[n, 2] = kept.real, kept.imag, desired[n]
        voltage[n, 0], voltage[n, 1] = u.real, u.imag
