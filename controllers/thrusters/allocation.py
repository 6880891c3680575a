"""From a wanted torque and force to on-times of thrusters, which can only push.

All arrays may have leading vehicle axes.
"""

from typing import Any

import numpy as np
from numba import guvectorize, njit

from mjspace.contract import Array

_SMALL = 1e-12


def effect(positions: Array, directions: Array, force: Array) -> Array:
    """Return the torque [N m] and force [N] of each thruster that is on, shape (6, n), body axes.

    ``positions`` (n, 3) [m] are about the centre of mass, ``directions`` (n, 3) are unit vectors of
    the force on the vehicle, ``force`` (n,) [N].
    """
    pushes = force[:, None] * directions
    return np.concatenate([np.cross(positions, pushes), pushes], axis=1).T


def share(wanted: Array, effects: Array) -> Array:
    """Return the shares x >= 0 (..., n) that minimize |effects x - wanted|.

    ``wanted`` (..., m) has the units of ``effects`` (m, n), whose columns are what each thruster
    does when it is on all the time; a share above one is more than it can. At most m of them are
    not zero. Lawson and Hanson 1974, "Solving Least Squares Problems", chapter 23.
    """
    found: Array = _share.ufunc(wanted, effects)
    return found


def within(shares: Array) -> tuple[Array, Array]:
    """Return (shares no larger than one, the factor that they shrank by), (..., n) and (..., 1)."""
    factor = 1.0 / np.maximum(shares.max(axis=-1, keepdims=True), 1.0)
    return factor * shares, factor


def pulses(shares: Array, carry: Array, period: float, minimum_on: float) -> tuple[Array, Array]:
    """Return (on-times [s], what is carried over [s]), each (..., n), for one control period.

    Each thruster is to be on for its share, at most one, of the ``period`` [s]. Less than
    ``minimum_on`` [s] is not fired but added to what is asked for next, and so is what would not
    fit into the period: so the mean is right in the long run.
    """
    due = shares * period + carry
    on_time = np.where(due < minimum_on, 0.0, np.minimum(due, period))
    return on_time, due - on_time


def pattern(axis: Array, effects: Array) -> Array:
    """Return the shares (n,), the largest of them one, of a pure torque about ``axis`` (3,).

    Raises:
        ValueError: the thrusters cannot turn the vehicle about it without a push or another turn.
    """
    wanted = np.concatenate([axis, np.zeros(3)])
    shares = share(wanted, effects)
    if not np.allclose(effects @ shares, wanted, atol=1e-9):
        raise ValueError(f"the thrusters make no pure torque about {np.asarray(axis).tolist()}")
    most: Array = shares / shares.max()
    return most


@njit(cache=True)
def _least_squares(effects: Any, wanted: Any, chosen: Any, count: int, solution: Any) -> None:
    """Solve for the ``chosen`` columns by modified Gram-Schmidt: they are independent."""
    m = wanted.size
    q, r, left = np.empty((count, m)), np.zeros((count, count)), wanted.copy()
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


@guvectorize(["void(f8[:],f8[:,:],f8[:])"], "(m),(m,n)->(n)", cache=True)
def _share(wanted: Any, effects: Any, shares: Any) -> None:
    m, n = effects.shape
    chosen = np.zeros(n, np.int64)  # the first `count` of them are free, all others zero
    count = 0
    trial = np.zeros(n)
    shares[:] = 0.0
    tolerance = _SMALL * np.sqrt(np.sum(effects * effects) * np.sum(wanted * wanted))
    for _ in range(3 * n):
        best, steepest = -1, tolerance
        for j in range(n):
            slope, free = 0.0, False
            for i in range(m):
                left = wanted[i]
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
            _least_squares(effects, wanted, chosen, count, trial)
            # As far towards the least squares as no share falls below zero.
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
