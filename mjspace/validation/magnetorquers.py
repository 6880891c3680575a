"""The B-dot law on ideal magnetorquers, compiled for evaluation at every stage."""

from typing import Any

import numpy as np
from numba import njit

from mjspace.environment import kepler
from mjspace.environment.dipole import dipole

_HALF = 0.1  # s, half the interval of the field's central difference; error (2 n HALF)^2 / 6


@njit(cache=True, error_model="numpy")
def b_dot(axes: Any, w: Any, field: Any, change: Any, gain: float) -> Any:
    """Return the generalized force (6,) of a dipole moment m = -gain dB/dt, whose torque is m x B.

    The derivative is that in body axes, the columns of ``axes`` (9,); ``w`` [rad/s] is in them.
    ``field`` [T] and its ``change`` [T/s] are in inertial axes, ``gain`` in A m^2 s/T.
    """
    B, D, force = np.empty(3), np.empty(3), np.zeros(6)
    for i in range(3):
        B[i] = axes[i] * field[0] + axes[3 + i] * field[1] + axes[6 + i] * field[2]
        D[i] = axes[i] * change[0] + axes[3 + i] * change[1] + axes[6 + i] * change[2]
    D[0] -= w[1] * B[2] - w[2] * B[1]
    D[1] -= w[2] * B[0] - w[0] * B[2]
    D[2] -= w[0] * B[1] - w[1] * B[0]
    force[3] = -gain * (D[1] * B[2] - D[2] * B[1])
    force[4] = -gain * (D[2] * B[0] - D[0] * B[2])
    force[5] = -gain * (D[0] * B[1] - D[1] * B[0])
    return force


@njit(cache=True, error_model="numpy")
def b_dot_in_orbit(axes: Any, w: Any, orbit: Any, time: float, strength: float, gain: float) -> Any:
    """Return ``b_dot`` at ``time`` [s] on ``orbit``, packed, about a dipole along z.

    ``strength`` [T m^3] is the dipole's.
    """
    north, change = (0.0, 0.0, 1.0), np.empty(3)
    before = dipole(kepler.position(orbit, time - _HALF), north, strength)
    after = dipole(kepler.position(orbit, time + _HALF), north, strength)
    for i in range(3):
        change[i] = (after[i] - before[i]) / (2.0 * _HALF)
    field = dipole(kepler.position(orbit, time), north, strength)
    return b_dot(axes, w, field, change, gain)
