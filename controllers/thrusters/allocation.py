"""Allocation: from a desired torque and force to on-times of thrusters, which can only push.

All arrays may have leading vehicle axes.
"""

from typing import Any

import numpy as np
from numba import njit

from mjspace.contract import Array
from mjspace.gufunc import gufunc

_SMALL = 1e-12


def effect(positions: Array, directions: Array, force: Array) -> Array:
    """Return the torque [N m] and force [N] of each thruster that is on, body axes, shape (6, n).

    ``positions`` (n, 3) [m] are from the centre of mass, ``directions`` (n, 3) are unit vectors of
    the force on the vehicle, ``force`` (n,) [N] is each thruster's.
    """
    pushes = force[:, None] * directions
    return np.concatenate([np.cross(positions, pushes), pushes], axis=1).T


def share(desired: Array, effects: Array) -> Array:
    """Return the shares x >= 0 (..., n) that minimize |effects x - desired|.

    A share is a thruster's fraction of the time; above one it exceeds the thruster's capability.
    ``effects`` (m, n) has a column for each thruster that is on continuously, ``desired`` (..., m)
    the same units. At most m shares are not zero. Lawson and Hanson 1974, "Solving Least Squares
    Problems", chapter 23.
    """
    found: Array = _share.ufunc(desired, effects)
    return found


def within(shares: Array) -> tuple[Array, Array]:
    """Return (shares scaled to at most one, the scale factor), (..., n) and (..., 1)."""
    factor = 1.0 / np.maximum(shares.max(axis=-1, keepdims=True), 1.0)
    return factor * shares, factor


def pulses(
    shares: Array, carry: Array, period: float, minimum_on: Array | float
) -> tuple[Array, Array]:
    """Return (on-times [s], remainders [s]), each (..., n), for one control period.

    Each thruster should be on for its share, at most one, of the ``period`` [s]. ``carry`` (..., n)
    [s] is the remainder of the last period. On-times below ``minimum_on`` [s], of all or (n,), and
    what exceeds the period, are not fired but carried over, so that the mean is right in the long
    run.
    """
    due = shares * period + carry
    on_time = np.where(due < minimum_on, 0.0, np.minimum(due, period))
    return on_time, due - on_time


def pattern(axis: Array, effects: Array) -> Array:
    """Return the shares (n,), the largest of them one, of a pure torque about ``axis`` (3,).

    Raises:
        ValueError: the thrusters cannot make this torque without a net force or another torque.
    """
    desired = np.concatenate([axis, np.zeros(3)])
    shares = share(desired, effects)
    if not np.allclose(effects @ shares, desired, atol=1e-9):
        raise ValueError(f"the thrusters make no pure torque about {np.asarray(axis).tolist()}")
    most: Array = shares / shares.max()
    return most


@njit(cache=True)
def _least_squares(effects: Any, desired: Any, chosen: Any, count: int, solution: Any) -> None:
    """Solve for the ``chosen`` columns, which are independent, by modified Gram-Schmidt."""
    m = desired.size
    q, r, left = np.empty((count, m)), np.zeros((count, count)), desired.copy()
    for j in range(count):
        for i in range(m):
            q[j, i] = effects[i, chosen[j]]
        for k in range(j):
            for i in range(m):
                r[k, j] += q[k, i] * q[j, i]
            for i in range(m):
                q[j, i] -= r[k, j] * q[k, i]
        for i in range(m):
            r[j, j] += q[j, i] * q[j, i]
        r[j, j] = np.sqrt(r[j, j])
        solution[j] = 0.0
        for i in range(m):
            q[j, i] /= r[j, j]
            solution[j] += q[j, i] * left[i]
        for i in range(m):
            left[i] -= solution[j] * q[j, i]
    for j in range(count - 1, -1, -1):
        for k in range(j + 1, count):
            solution[j] -= r[j, k] * solution[k]
        solution[j] /= r[j, j]


@gufunc(["void(f8[:],f8[:,:],f8[:])"], "(m),(m,n)->(n)")
def _share(desired: Any, effects: Any, shares: Any) -> None:
    m, n = effects.shape
    chosen = np.zeros(n, np.int64)  # the first `count` of them are free, all others zero
    count = 0
    trial = np.zeros(n)
    shares[:] = 0.0
    tolerance = _SMALL * np.sqrt(np.sum(effects * effects) * np.sum(desired * desired))
    for _ in range(3 * n):
        best, steepest = -1, tolerance
        for j in range(n):
            slope, free = 0.0, False
            for i in range(m):
                left = desired[i]
                for k in range(count):
                    left -= effects[i, chosen[k]] * shares[chosen[k]]
                slope += effects[i, j] * left
            for k in range(count):
                free = free or chosen[k] == j
            if not free and slope > steepest:
                best, steepest = j, slope
        if best < 0 or count == m:
            return
        chosen[count] = best
        count += 1
        while count:
            _least_squares(effects, desired, chosen, count, trial)
            # Move towards the least-squares solution until a share reaches zero.
            way = 1.0
            for k in range(count):
                j = chosen[k]
                if trial[k] <= 0.0:
                    way = min(way, shares[j] / (shares[j] - trial[k]) if shares[j] > 0.0 else 0.0)
            kept = 0
            for k in range(count):
                j = chosen[k]
                blocked = trial[k] <= 0.0 and shares[j] <= way * (shares[j] - trial[k]) + _SMALL
                shares[j] = 0.0 if blocked else shares[j] + way * (trial[k] - shares[j])
                if not blocked:
                    chosen[kept] = j
                    kept += 1
            whole = kept == count
            count = kept
            if whole:
                break
