"""The motion from a position and velocity around the oblate Earth, integrated.

The acceleration is that of the zonal harmonic of degree 2: Vallado 2013, Fundamentals of
Astrodynamics and Applications, 4th edition, section 8.6.1, with the Earth's axis along z.
"""

import functools
import math
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.environment.constants import GM, J2, RADIUS

_PIECE = 6000.0
"""s, of one integration: pieces begin at whole multiples, so that a place is the same whatever
times were requested before."""
_TOLERANCE = {"rtol": 1e-12, "atol": 1e-9}  # atol in m and m/s
_GM, _OBLATE = GM["earth"], 1.5 * J2["earth"] * RADIUS["earth"] ** 2

State = tuple[float, ...]
"""Position [m] and velocity [m/s], inertial axes from the Earth's centre."""


def motion(position: Array, velocity: Array, time: Array) -> tuple[Array, Array]:
    """Return position [m] and velocity [m/s], (n, 3) each, at ``time`` [s], (n,), of any sign.

    ``position`` and ``velocity``, (3,), are those at time zero.
    """
    start = (*map(float, position), *map(float, velocity))
    index = np.floor(time / _PIECE).astype(int)
    found = np.empty((len(time), 6))
    for number in np.unique(index):
        chosen = index == number
        found[chosen] = _piece(start, int(number))(time[chosen]).T
    at_start = time == 0.0
    found[at_start] = start  # the interpolation rounds
    return found[:, :3], found[:, 3:]


def pull(place: Array) -> Array:
    """Return the radial acceleration at ``place`` [m], (n, 3), over that of a sphere, (n,)."""
    distance2 = np.sum(place**2, axis=-1)
    part: Array = 1.0 + _OBLATE / distance2 * (1.0 - 3.0 * place[:, 2] ** 2 / distance2)
    return part


def _piece(start: State, number: int) -> Any:
    """Return the solution as a function of time, from ``number`` times ``_PIECE`` on."""
    from scipy.integrate import solve_ivp  # which takes 0.2 s

    ahead, behind = _pieces(start)
    pieces, count = (ahead, number + 1) if number >= 0 else (behind, -number)
    while len(pieces) < count:
        sign = 1.0 if pieces is ahead else -1.0
        begin, end = sign * len(pieces) * _PIECE, sign * (len(pieces) + 1) * _PIECE
        state = pieces[-1](begin) if pieces else start
        flown = solve_ivp(_slope, (begin, end), state, "DOP853", dense_output=True, **_TOLERANCE)
        pieces.append(flown.sol)
    return pieces[count - 1]


@functools.lru_cache(maxsize=16)
def _pieces(start: State) -> tuple[list[Any], list[Any]]:
    """Return the pieces after and before time zero that are integrated so far, for adding to."""
    return [], []


def _slope(_: float, state: Array) -> State:
    x, y, z, *velocity = state.tolist()
    distance2 = x * x + y * y + z * z
    central = -_GM / (distance2 * math.sqrt(distance2))
    oblate = _OBLATE / distance2
    level = 5.0 * z * z / distance2
    across, along = central * (1.0 + oblate * (1.0 - level)), 1.0 + oblate * (3.0 - level)
    return *velocity, across * x, across * y, central * along * z
