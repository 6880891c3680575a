"""Positions on a Kepler orbit, compiled, so that a native callback can call them too."""

import math
from typing import Any

import numpy as np

from mjspace.environment.compiled import compiled
from mjspace.gufunc import gufunc

_STEP = 1e-8
"""Whose square is less than the rounding of an angle [rad]."""


@compiled
def eccentric_anomaly(mean: float, eccentricity: float) -> float:
    """Return the root E of Kepler's equation, E - eccentricity sin E = mean [rad], in [-pi, pi].

    Newton's iteration from above: on [0, pi] the left side is convex, and E is at most each of
    mean + e, mean / (1 - e) and pi, so that every step goes down until rounding stops it. After a
    step d at most e / (1 - e) d^2 / 2 is left, which is not flown where it is less than rounding.
    """
    enough = _STEP * math.sqrt(1.0 - eccentricity)
    mean -= 2.0 * math.pi * np.rint(mean / (2.0 * math.pi))
    target = abs(mean)
    root = min(target + eccentricity, target / (1.0 - eccentricity), math.pi)
    while True:
        miss = root - eccentricity * math.sin(root) - target
        lower = root - miss / (1.0 - eccentricity * math.cos(root))
        if not lower < root:
            return math.copysign(root, mean)
        if root - lower < enough:
            return math.copysign(lower, mean)
        root = lower


@compiled
def position(orbit: Any, time: float) -> tuple[float, float, float]:
    """Return the position [m], inertial axes from the planet's centre, at ``time`` [s].

    ``orbit`` is what ``Orbit.elements`` returns.
    """
    anomaly = eccentric_anomaly(orbit[2] + orbit[1] * time, orbit[3])
    along, across = math.cos(anomaly) - orbit[3], math.sin(anomaly)
    return (
        along * orbit[4] + across * orbit[7],
        along * orbit[5] + across * orbit[8],
        along * orbit[6] + across * orbit[9],
    )


@compiled
def motion(orbit: Any, time: float) -> tuple[float, float, float, float, float, float]:
    """Return ``position`` and ``velocity``, one solution of Kepler's equation for both."""
    anomaly = eccentric_anomaly(orbit[2] + orbit[1] * time, orbit[3])
    cosine, sine = math.cos(anomaly), math.sin(anomaly)
    rate = orbit[1] / (1.0 - orbit[3] * cosine)
    along, across = cosine - orbit[3], sine
    faster, ahead = -rate * sine, rate * cosine
    return (
        along * orbit[4] + across * orbit[7],
        along * orbit[5] + across * orbit[8],
        along * orbit[6] + across * orbit[9],
        faster * orbit[4] + ahead * orbit[7],
        faster * orbit[5] + ahead * orbit[8],
        faster * orbit[6] + ahead * orbit[9],
    )


@compiled
def velocity(orbit: Any, time: float) -> tuple[float, float, float]:
    """Return the velocity [m/s], inertial axes, at ``time`` [s]; ``orbit`` as for ``position``."""
    _, _, _, x, y, z = motion(orbit, time)
    return x, y, z


@gufunc(["void(f8[:], f8, f8[:], f8[:], f8[:])"], "(e),(),(v)->(v),(v)")
def along(orbit: Any, time: Any, _: Any, place: Any, speed: Any) -> None:
    """Fill in ``position`` and ``velocity`` at ``time``; the third is there for its length, 3."""
    place[0], place[1], place[2], speed[0], speed[1], speed[2] = motion(orbit, time)
