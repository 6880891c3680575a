"""The arithmetic of the motors' loops: one generalized ufunc for each, over any motors.

Scalar arithmetic without fused or reordered sums: a motor's numbers are bit for bit the same alone
and in a batch. Numba's cache does not notice changes in other files, so that all compiled functions
are in this one.
"""

# mypy: disable-error-code="no-untyped-call, call-arg"
from typing import Any

import numpy as np
from numba import guvectorize

_TINY = 1e-12  # added to psi^2, far below any estimate: sin(psi x) / psi is regular


@guvectorize(
    ["void(f8[:,:],f8[:,:],f8[:],f8[:],f8[:,:],f8[:,:],f8[:,:])"],
    "(m,k),(m,k),(m),(m),(g,m)->(m,k),(m,k)",
    cache=True,
)
def current_loop(
    integral: Any, current: Any, desired: Any, speed: Any, gains: Any,
    integral_out: Any, voltage: Any,
) -> None:  # fmt: skip
    """Paper 001, (4.36), (4.37); gains [p, L, km, kep, kei, voltage limit, period]."""
    for n in range(speed.size):
        p, L, km, kep, kei = gains[0, n], gains[1, n], gains[2, n], gains[3, n], gains[4, n]
        limit, period = gains[5, n], gains[6, n]
        d, q = current[n, 0], current[n, 1]
        error_d, error_q = d, q - desired[n]
        u_d = L * (-p * speed[n] * q - kep * error_d - kei * integral[n, 0])
        u_q = L * (p * speed[n] * d - kep * error_q - kei * integral[n, 1]) + km * speed[n]
        voltage[n, 0], voltage[n, 1] = u_d, u_q
        # Anti-windup: beyond the supply's limit the integrals hold.
        held = 0.0 if np.hypot(u_d, u_q) > limit else period
        integral_out[n, 0] = integral[n, 0] + held * error_d
        integral_out[n, 1] = integral[n, 1] + held * error_q


@guvectorize(
    ["void(f8[:,:],f8[:,:],f8[:],f8[:],f8[:],f8[:],f8[:],f8[:,:],f8[:,:],f8[:])"],
    "(m,s),(m,k),(m),(m),(m),(m),(m),(g,m)->(m,s),(m)",
    cache=True,
)
def speed_loop(
    memory: Any, current: Any, speed: Any, carried: Any, desired: Any, acceleration: Any,
    load: Any, gains: Any, after: Any, commanded: Any,
) -> None:  # fmt: skip
    """Paper 001, (4.19)-(4.22), (4.34), (4.35).

    Gains [J, km, kp, ki, ko, ke, ka, lead, limits of ratio, vibration and current, period]; memory
    [W, km I_q - load, integral of the error, W_hat, z1_hat, z2_hat, phi_hat, speed, commanded I_q];
    W is speed + carried.
    """
    for n in range(speed.size):
        J, km, kp, ki, lead = gains[0, n], gains[1, n], gains[2, n], gains[3, n], gains[7, n]
        ko, ke, ka = gains[4, n], gains[5, n], gains[6, n]
        phi_limit, z_limit = gains[8, n], gains[9, n]
        current_limit, period = gains[10, n], gains[11, n]
        W, before = speed[n] + carried[n], memory[n, 0]
        drive_before, integral = memory[n, 1], memory[n, 2]
        error = desired[n] - W
        drive = km * current[n, 1] - load[n]

        W_hat, z1, z2, phi = W, 0.0, 0.0, memory[n, 6]
        if ke > 0.0:
            # From the last instant to this one with the means of both measurements: the internal
            # model rotates by exactly the angle of the rotor.
            mean_W, mean_drive = 0.5 * (speed[n] + memory[n, 7]), 0.5 * (drive + drive_before)
            z1_before, z2_before, slip = memory[n, 4], memory[n, 5], memory[n, 3] - before
            psi, turn = np.sqrt(phi + _TINY), period * mean_W
            cos, sin = np.cos(psi * turn), np.sin(psi * turn)
            z1 = cos * z1_before + psi * sin * z2_before - period * ke * (slip + error)
            z2 = cos * z2_before - sin / psi * z1_before
            mean_z1, mean_z2 = 0.5 * (z1 + z1_before), 0.5 * (z2 + z2_before)
            W_hat = memory[n, 3] + period * (mean_drive + mean_z1 - ko * slip) / J
            # (4.34) and (4.35), summed by parts over the period.
            residual = period * (mean_z1 + mean_drive) - J * (W - before)
            phi -= ka * mean_W * mean_z2 * residual
            if phi > phi_limit:
                phi = phi_limit
            if phi < 0.0:
                phi = 0.0
            length = np.hypot(z1, np.sqrt(phi) * z2)
            beyond = length > z_limit
            # Both branches are computed: the divisor must not be zero.
            share = (z_limit if beyond else 1.0) / (length if beyond else 1.0)
            z1, z2 = share * z1, share * z2

        psi = np.sqrt(phi)
        angle = psi * speed[n] * lead
        ahead = np.cos(angle) * z1 + np.sin(angle) * psi * z2
        torque = J * acceleration[n] + load[n] + kp * error + ki * integral - ahead
        unlimited = torque / km
        limited = unlimited
        if abs(unlimited) > current_limit:
            limited = np.copysign(current_limit, unlimited)
        commanded[n] = limited
        if limited == unlimited:
            integral += period * error
        after[n, 0], after[n, 1], after[n, 2], after[n, 3] = W, drive, integral, W_hat
        after[n, 4], after[n, 5], after[n, 6] = z1, z2, phi
        after[n, 7], after[n, 8] = speed[n], limited
