"""The torques of wheels' motors: a torque on the bus shared among them, within their limits."""

from typing import Any

import numpy as np

from mjspace.gufunc import gufunc

_MISSED = 1e-9, 1e-12
"""Rounding where no wheel gives any torque: part of the commanded torque, and N m."""


# Products are written out: BLAS may round one vehicle's differently in a batch than alone.
@gufunc(
    ["void(f8[:], f8[:], f8[:, :], f8[:], f8[:], f8[:], f8[:], f8[:, :], f8, f8[:], f8[:])"],
    "(k),(n),(n,k),(n),(n),(n),(n),(u,k),()->(n),(n)",
)
def motor_torques(
    torque: Any,
    speed: Any,
    allocation: Any,
    spare: Any,
    torque_limit: Any,
    speed_limit: Any,
    inertia: Any,
    unreachable: Any,
    step: Any,
    ctrl: Any,
    saturated: Any,
) -> None:
    """Compute what ``ReactionWheels.motor_torque`` returns."""
    best, least = 0.0, 0.0
    for i in range(speed.size):
        desired = 0.0
        for k in range(torque.size):
            desired += allocation[i, k] * torque[k]
        ctrl[i] = desired
        least = max(least, abs(desired))
    # The largest of |ctrl + t spare| is least where two wheels are level: all t of such pairs are
    # tried, and none, which stays where it is as good.
    for i in range(speed.size):
        for j in range(i):
            for sign in (-1.0, 1.0):
                slope = spare[i] + sign * spare[j]
                if slope != 0.0:
                    t, peak = -(ctrl[i] + sign * ctrl[j]) / slope, 0.0
                    for k in range(speed.size):
                        peak = max(peak, abs(ctrl[k] + t * spare[k]))
                    if peak < least:
                        best, least = t, peak
    missed, largest = 0.0, 0.0
    for k in range(torque.size):
        largest = max(largest, abs(torque[k]))
    for u in range(unreachable.shape[0]):
        part = 0.0
        for k in range(torque.size):
            part += unreachable[u, k] * torque[k]
        missed = max(missed, abs(part))
    beyond = missed > max(_MISSED[0] * largest, _MISSED[1])
    for i in range(speed.size):
        desired = ctrl[i] + best * spare[i]
        applied = desired
        if abs(applied) > torque_limit[i]:
            applied = np.copysign(torque_limit[i], desired)
        if speed_limit[i] < np.inf:
            most = max(speed_limit[i] - speed[i], 0.0) * inertia[i] / step
            least = min(-speed_limit[i] - speed[i], 0.0) * inertia[i] / step
            applied = least if applied < least else most if applied > most else applied
        ctrl[i] = applied
        saturated[i] = 1.0 if applied != desired or beyond else 0.0
