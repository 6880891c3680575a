"""Apollo's lunar-descent guidance: an acceleration that is quadratic in time meets a target.

A. R. Klumpp, "Apollo lunar descent guidance", Automatica 10 (1974) 133-146. A target has a
position, a velocity, an acceleration and, along one axis, a jerk; the path to it is a quartic in
time. All arrays may have leading vehicle axes.
"""

from typing import NamedTuple

import numpy as np

from mjspace.contract import Array

ITERATIONS = 5
"""Of Newton's method, from the time to go of the last step: two leave rounding."""
SHORTEST = 1.0
"""s: the least time to go that is divided by."""


class Target(NamedTuple):
    """Where a phase of the descent ends; axes are those of the vehicle's position."""

    position: Array
    """[m], (..., 3)."""
    velocity: Array
    """[m/s], (..., 3)."""
    acceleration: Array
    """[m/s^2], (..., 3)."""


def acceleration(position: Array, velocity: Array, target: Target, time_to_go: Array) -> Array:
    """Return the acceleration [m/s^2] that reaches the target in ``time_to_go`` [s], (..., 3).

    ``position`` [m] and ``velocity`` [m/s] are (..., 3), ``time_to_go`` is (..., 1). Gravity is in
    it: the thrust has to give what gravity does not.
    """
    left = np.maximum(time_to_go, SHORTEST)
    way = 12.0 * (target.position - position) / left**2
    found: Array = target.acceleration + way - 6.0 * (velocity + target.velocity) / left
    return found


def time_to_go(
    distance: Array, speed: Array, goal: tuple[Array, Array, Array], guess: Array
) -> Array:
    """Return the time to go [s] with which the path has the target's jerk along one axis, (..., 1).

    ``distance`` [m] and ``speed`` [m/s] are the components of what is left of the way and of the
    velocity along it, ``goal`` the target's velocity [m/s], acceleration [m/s^2] and jerk [m/s^3]
    there, ``guess`` [s] a time to go to begin with; each (..., 1). With T = -(time to go) it is the
    root of jerk T^3 + 6 acceleration T^2 + 6 (3 goal + speed) T + 24 distance.
    """
    end, push, jerk = goal
    T = -guess
    for _ in range(ITERATIONS):
        value = ((jerk * T + 6.0 * push) * T + 6.0 * (3.0 * end + speed)) * T + 24.0 * distance
        slope = (3.0 * jerk * T + 12.0 * push) * T + 6.0 * (3.0 * end + speed)
        T = T - value / slope
    return -T
