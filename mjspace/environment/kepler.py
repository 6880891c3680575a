"""Positions on a Kepler orbit, compiled, so that a native callback can call them too."""

import math
from typing import Any

import numpy as np
from numba import njit

from mjspace.constants import GM
from mjspace.contract import Array
from mjspace.scenario.environment import Orbit


def pack(orbit: Orbit) -> Array:
    """Return the orbit as ten numbers.

    GM [m^3/s^2], mean motion [rad/s], mean anomaly at time zero [rad], eccentricity, then the two
    semi-axes as vectors [m], towards the periapsis and along the motion there.
    """
    a, e = orbit.semi_major_axis, orbit.eccentricity
    gm = GM[orbit.body]
    half = math.atan2(
        math.sqrt(1.0 - e) * math.sin(0.5 * orbit.true_anomaly),
        math.sqrt(1.0 + e) * math.cos(0.5 * orbit.true_anomaly),
    )
    mean_anomaly = 2.0 * half - e * math.sin(2.0 * half)
    # columns: towards the ascending node and 90 deg ahead of it in the orbit
    node, tilt = orbit.ascending_node, orbit.inclination
    ahead = [-math.sin(node) * math.cos(tilt), math.cos(node) * math.cos(tilt), math.sin(tilt)]
    plane = np.column_stack([[math.cos(node), math.sin(node), 0.0], ahead])
    cosine, sine = math.cos(orbit.periapsis), math.sin(orbit.periapsis)
    major = a * plane @ [cosine, sine]
    minor = a * math.sqrt(1.0 - e * e) * plane @ [-sine, cosine]
    return np.array([gm, math.sqrt(gm / a**3), mean_anomaly, e, *major, *minor])


@njit(cache=True, error_model="numpy")
def eccentric_anomaly(mean: float, eccentricity: float) -> float:
    """Return the root E of Kepler's equation, E - eccentricity sin E = mean [rad], in [-pi, pi].

    Newton's iteration from above: on [0, pi] the left side is convex, and E is at most each of
    mean + e, mean / (1 - e) and pi, so that every step goes down until rounding stops it.
    """
    mean -= 2.0 * math.pi * np.rint(mean / (2.0 * math.pi))
    target = abs(mean)
    root = min(target + eccentricity, target / (1.0 - eccentricity), math.pi)
    while True:
        miss = root - eccentricity * math.sin(root) - target
        lower = root - miss / (1.0 - eccentricity * math.cos(root))
        if not lower < root:
            return math.copysign(root, mean)
        root = lower


@njit(cache=True, error_model="numpy")
def position(orbit: Any, time: float) -> tuple[float, float, float]:
    """Return the position [m], inertial axes from the planet's centre, at ``time`` [s].

    ``orbit`` is what ``pack`` returns.
    """
    anomaly = eccentric_anomaly(orbit[2] + orbit[1] * time, orbit[3])
    along, across = math.cos(anomaly) - orbit[3], math.sin(anomaly)
    return (
        along * orbit[4] + across * orbit[7],
        along * orbit[5] + across * orbit[8],
        along * orbit[6] + across * orbit[9],
    )


@njit(cache=True, error_model="numpy")
def velocity(orbit: Any, time: float) -> tuple[float, float, float]:
    """Return the velocity [m/s], inertial axes, at ``time`` [s]; ``orbit`` as for ``position``."""
    anomaly = eccentric_anomaly(orbit[2] + orbit[1] * time, orbit[3])
    rate = orbit[1] / (1.0 - orbit[3] * math.cos(anomaly))
    along, across = -rate * math.sin(anomaly), rate * math.cos(anomaly)
    return (
        along * orbit[4] + across * orbit[7],
        along * orbit[5] + across * orbit[8],
        along * orbit[6] + across * orbit[9],
    )
