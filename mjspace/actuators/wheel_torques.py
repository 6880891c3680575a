"""The torques of wheels' motors: a torque on the bus shared among them, within their limits."""

from typing import Any

import numpy as np

from mjspace.contract import Array
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


def unreachable(axes: Array) -> Array:
    """Return unit vectors about which wheels with unit ``axes`` (n, 3) give no torque.

    Their shape is (3 - rank, 3). None for a vehicle without wheels, on which nothing relies.
    """
    if not len(axes):
        return np.zeros((0, 3))
    _, singular, right = np.linalg.svd(axes)
    missing = right[int(np.sum(singular > 1e-9)) :]
    largest = np.take_along_axis(missing, np.abs(missing).argmax(axis=1)[:, None], axis=1)
    found: Array = missing * np.sign(largest)
    return found


def spare(axes: Array) -> Array:
    """Return motor torques (n,) whose sum on the bus is zero, of wheels with unit ``axes`` (n, 3).

    Raises:
        ValueError: there are none, or more than one number to choose.
    """
    _, singular, right = np.linalg.svd(axes.T)
    free = len(axes) - int(np.sum(singular > 1e-9))
    if free != 1:
        raise ValueError(
            f"plant.wheels.allocation: least_peak needs one wheel more than their axes span, "
            f"as four of a pyramid are; here it is {free} more: use least_squares"
        )
    one: Array = right[-1]
    return np.where(np.abs(one) < 1e-12, 0.0, one)
