"""The Riccati differential equation of a finite horizon, without a limit on stiffness.

-P' = P A + A^T P - P S P + Q is the flow of x' = A x - S l, l' = -Q x - A^T l with l = P x. A step
of it is kept as (alpha, beta, gamma): x1 = alpha x0 - beta l1, l0 = gamma x0 + alpha^T l1. No part
of that grows with the length of the step, as the exponential of the Hamiltonian matrix does.
"""

import numpy as np
from scipy.linalg import expm

from mjspace.contract import Array

_NORM = 0.25  # of the exponential's argument; beyond, steps are doubled
_EARLY, _LATE = 0.5 - np.sqrt(3.0) / 6.0, 0.5 + np.sqrt(3.0) / 6.0


def nodes(time: Array) -> tuple[Array, Array]:
    """Return the two Gauss points (n - 1,) [s] of each interval of the ``time`` (n,) [s]."""
    step = np.diff(time)
    return time[:-1] + _EARLY * step, time[:-1] + _LATE * step


def backwards(early: Array, late: Array, S: Array, Q: Array, final: Array, time: Array) -> Array:
    """Return P (n, m, m) at each ``time`` (n,) [s]; it is ``final`` (m, m) at the last.

    ``early`` and ``late`` are A (n - 1, m, m) at the ``nodes`` of each interval, which is one step
    of the commutator-free Magnus method of fourth order (Blanes and Moan 2006, Applied Numerical
    Mathematics 56, CF4: two exponentials); it is exact where A is constant.
    """
    scale = np.sqrt(np.linalg.norm(Q) / np.linalg.norm(S))  # of P: S and Q are then of one size
    mean, change = 0.5 * (early + late), (late - early) / np.sqrt(3.0)
    halves = [
        _steps(A, scale * S, Q / scale, 0.5 * np.diff(time)) for A in (mean - change, mean + change)
    ]
    P = np.empty((len(time), *final.shape))
    P[-1] = final / scale
    eye = np.eye(len(final))
    for i in reversed(range(len(time) - 1)):
        cost = P[i + 1]
        for alpha, beta, gamma in ((half[i] for half in part) for part in reversed(halves)):
            cost = gamma + alpha.T @ cost @ np.linalg.solve(eye + beta @ cost, alpha)
        P[i] = 0.5 * (cost + cost.T)
    P *= scale
    P[-1] = final
    return P


def _steps(A: Array, S: Array, Q: Array, step: Array) -> tuple[Array, Array, Array]:
    """Return alpha, beta and gamma (n, m, m) of a step of each length (n,) [s] with A (n, m, m).

    Short steps are exponentials, and are doubled: Chu, Fan and Lin 2005, "A structure-preserving
    doubling algorithm for continuous-time algebraic Riccati equations", Linear Algebra and its
    Applications 396.
    """
    m = len(S)
    H = np.empty((len(A), 2 * m, 2 * m))
    H[:, :m, :m], H[:, :m, m:], H[:, m:, :m], H[:, m:, m:] = A, -S, -Q, -A.swapaxes(-1, -2)
    H *= step[:, None, None]
    longest = np.abs(H).sum(axis=-2).max(initial=_NORM)
    doublings = int(np.ceil(np.log2(longest / _NORM)))
    flow = expm(H / 2.0**doublings)
    alpha = np.linalg.inv(flow[:, m:, m:]).swapaxes(-1, -2)
    beta = -flow[:, :m, m:] @ alpha.swapaxes(-1, -2)
    gamma = -alpha.swapaxes(-1, -2) @ flow[:, m:, :m]
    eye = np.eye(m)
    for _ in range(doublings):
        turned = alpha.swapaxes(-1, -2)
        first = np.linalg.solve(eye + beta @ gamma, alpha)
        second = np.linalg.solve(eye + gamma @ beta, turned)
        alpha, beta, gamma = (
            alpha @ first,
            beta + alpha @ beta @ second,
            gamma + turned @ gamma @ first,
        )
    return alpha, beta, gamma
