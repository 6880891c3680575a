"""Steering of single-gimbal variable-speed CMGs: torque and power by gimbals and wheels together.

VSCMG i is as CMG i of ``cmg_steering``, but its wheel's motor applies a torque u_i. With its
momentum h_i = Jw W_i along s_i and the axis across, t_i = g_i x s_i, the torque on the bus and the
power into the wheels are

    tau = -sum h_i t_i d_i' - sum s_i u_i,    P = sum W_i u_i,

four equations for 2n unknowns. Of the solutions the weighted least is taken; a motion that gives
neither torque nor power is added to it. P. Tsiotras, H. Shen, C. Hall, "Satellite attitude control
and power tracking with energy/momentum wheels", Journal of Guidance, Control, and Dynamics 24
(2001); H. Yoon, P. Tsiotras, "Spacecraft adaptive attitude and power tracking with variable speed
control moment gyroscopes", the same 25 (2002). They command wheel accelerations; here it is the
motor's torque, which is Jw (W' + s w') + Jw (t w) d' on a bus that turns at w.
"""

# mypy: disable-error-code="no-untyped-call, call-arg"
import math
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.gufunc import gufunc

from .cmg_steering import Cluster, spin_axis


def share(
    cluster: Cluster,
    torque: Array,
    power: Array,
    gimbal_angle: Array,
    wheel_speed: Array,
    null_torque: Array,
    scales: Array,
) -> tuple[Array, Array]:
    """Return gimbal rates [rad/s] and wheel torques [N m], each (..., n).

    ``torque`` (..., 3) [N m] is commanded on the bus, body axes; ``power`` (..., 1) [W] into the
    wheels; ``null_torque`` (..., n) [N m] is what the wheels would do of themselves, of which the
    part that gives neither torque nor power is done. ``scales`` is [rad/s, N m]: a gimbal rate and
    a wheel torque that cost the same.

    With x = (d', u) / scales and Q x = (tau, P), x = Q^T (Q Q^T)^-1 ((tau, P) - Q x0) + x0. All
    wheels at rest give no power: the rates are then infinite.
    """
    rate, wheel_torque = _share.ufunc(
        torque, power, gimbal_angle, wheel_speed, null_torque, *cluster, scales
    )
    return rate, wheel_torque


@gufunc(
    [
        "void(f8[:],f8[:],f8[:],f8[:],f8[:],f8[:,:],f8[:,:],f8[:],f8[:],f8[:],f8[:])",
    ],
    "(v),(o),(n),(n),(n),(n,v),(n,v),(n),(k)->(n),(n)",
)
def _share(
    torque: Any, power: Any, angle: Any, speed: Any, null_torque: Any, g: Any, s0: Any, Jw: Any,
    scales: Any, rate: Any, wheel_torque: Any,
) -> None:  # fmt: skip
    n = angle.size
    Q = np.zeros((4, 2 * n))
    left = np.array([torque[0], torque[1], torque[2], power[0]])
    for i in range(n):
        s, t = spin_axis(g[i], s0[i], angle[i])
        for k in range(3):
            Q[k, i] = -Jw[i] * speed[i] * t[k] * scales[0]
            Q[k, n + i] = -s[k] * scales[1]
        Q[3, n + i] = speed[i] * scales[1]
    # One row scaled to the others: torques of newton metres, power by the fastest wheel.
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(speed[i]))
    per_speed = 1.0 / largest if largest > 0.0 else math.inf
    left[3] *= per_speed
    for i in range(n):
        Q[3, n + i] *= per_speed
        for k in range(4):
            left[k] -= Q[k, n + i] * null_torque[i] / scales[1]
    # Cholesky: Q Q^T = L L^T.
    L = np.zeros((4, 4))
    for row in range(4):
        for column in range(row + 1):
            total = 0.0
            for i in range(2 * n):
                total += Q[row, i] * Q[column, i]
            for k in range(column):
                total -= L[row, k] * L[column, k]
            if row == column:
                L[row, row] = math.sqrt(max(total, 0.0))
            else:
                L[row, column] = total / L[column, column] if L[column, column] > 0.0 else math.inf
    for row in range(4):
        for k in range(row):
            left[row] -= L[row, k] * left[k]
        left[row] = left[row] / L[row, row] if L[row, row] > 0.0 else math.inf
    for row in range(3, -1, -1):
        for k in range(row + 1, 4):
            left[row] -= L[k, row] * left[k]
        left[row] = left[row] / L[row, row] if L[row, row] > 0.0 else math.inf
    for i in range(n):
        rate[i], wheel_torque[i] = 0.0, null_torque[i]
        for k in range(4):
            rate[i] += scales[0] * Q[k, i] * left[k]
            wheel_torque[i] += scales[1] * Q[k, n + i] * left[k]
