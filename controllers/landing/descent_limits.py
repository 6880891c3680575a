"""Limits of a descent to the Moon, and the Bezier curve of given duration that burns least.

Positions are (along, across, up) from the site [m]; the ground is flat.
"""

from dataclasses import dataclass

import numpy as np

from mjspace.contract import Array

from . import cone_program
from .bezier import bernstein, curve
from .cone_program import Affine

SCALE = 100.0
"""Unit of length of the optimization [m]: its numbers should be of order one."""
ROOM = 1.5e-3
"""Margin of the optimization to its limits, in units of the vehicle's weight and of ``SCALE``: with
it the limits also hold between the instants of the grid."""
GRID = 201
"""Number of instants at which the optimization checks the limits."""
FREE = np.zeros((10, 3, 10))
"""Derivative of (along, across, up) of the ten points by each of the ten unknowns."""
FREE[[0, 1, 2, 3], [0, 1, 0, 1], [4, 4, 5, 5]] = SCALE
FREE[range(4, 10), 2, range(2, 8)] = SCALE


@dataclass(frozen=True)
class Limits:
    """Limits of a descent."""

    mass: float
    """Mass of the vehicle [kg], taken as constant."""
    gravity: float
    """Gravity at the site [m/s^2]."""
    thrust: tuple[float, float]
    """Least and largest thrust [N]."""
    tilt: float
    """Largest angle of the thrust from the vertical [rad]."""
    glide_slope: float
    """Least height over horizontal distance from the end; a metre of height is tolerated."""
    clearance: float
    """Height of the end above the site [m]."""
    descent_speed: float
    """Downward speed at the end [m/s]."""

    @property
    def end(self) -> Array:
        """Position of the end [m], shape (3,)."""
        return np.array([0.0, 0.0, self.clearance])

    @property
    def effort(self) -> Array:
        """Least and largest thrust over the vehicle's weight, shape (2,)."""
        return np.array(self.thrust) / (self.mass * self.gravity)


def shortest_duration(height: float, speed: float, limits: Limits) -> float:
    """Return a lower bound of a descent's duration [s]; inf where it cannot brake in time.

    The vehicle falls from ``height`` [m] at ``speed`` [m/s, down] as fast as the limits allow, then
    brakes with full thrust to the descent speed.
    """
    least, most = limits.effort
    drop = limits.gravity * (1.0 - least * np.cos(limits.tilt))
    brake = limits.gravity * (most - 1.0)
    last = limits.descent_speed
    # The glide slope admits a position one metre below the end.
    if brake <= 0.0 or speed**2 - last**2 > 2.0 * brake * (height + 1.0):
        return float("inf")
    square = (2.0 * height * drop * brake + brake * speed**2 + drop * last**2) / (drop + brake)
    peak = max(np.sqrt(max(square, 0.0)), speed, last)
    return float((peak - speed) / drop + (peak - last) / brake)


def keeps(points: Array, duration: float, place: Array, velocity: Array, limits: Limits) -> bool:
    """Tell whether a descent is within ``limits`` at every 2000th of its ``duration`` [s].

    ``points`` (n, 3) [m] are its control points. It has to start at ``place`` [m] with ``velocity``
    [m/s] and end as the limits say, at both ends without horizontal acceleration and jerk, to
    within 1e-3 m, m/s, m/s^2 and m/s^3.
    """
    if not 0.0 < duration < np.inf:
        return False
    motion = curve(points, duration, np.linspace(0.0, 1.0, 2001))
    effort = motion[2] / limits.gravity + np.array([0.0, 0.0, 1.0])
    size, aside = np.sqrt((effort**2).sum(axis=1)), np.hypot(effort[:, 0], effort[:, 1])
    upright = np.sin(limits.tilt) * effort[:, 2] - np.cos(limits.tilt) * aside
    way = motion[0] - limits.end
    above = way[:, 2] + 1.0 - limits.glide_slope * np.hypot(way[:, 0], way[:, 1])
    least, most = limits.effort
    within = np.array([size - least, most - size, upright, above]).min() >= 0.0
    last = np.array([0.0, 0.0, -limits.descent_speed])
    missed = [motion[0][0] - place, motion[1][0] - velocity, way[-1], motion[1][-1] - last]
    missed += [part[end, :2] for part in motion[2:4] for end in (0, -1)]
    return bool(within and np.abs(np.concatenate(missed)).max() < 1e-3)


def least_propellant(
    duration: float, place: Array, velocity: Array, limits: Limits
) -> tuple[Array, float]:
    """Return the control points (10, 3) [m] that burn least in ``duration`` [s], and their cost.

    The cost is the integral of thrust over weight [s], plus a penalty where no points are within
    the limits.
    """
    # Evenly spaced end points: no horizontal acceleration and jerk, hence no tilt and no rate.
    ends = np.arange(4)[:, None] * (duration / 9.0)
    fixed = np.zeros((10, 3))
    fixed[:4], fixed[:5:-1] = place + ends * velocity, limits.end
    fixed[:5:-1, 2] += ends[:, 0] * limits.descent_speed
    fixed[2:8, 2] = 0.0
    points = Affine(FREE, fixed.T)

    s = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, GRID))  # dense at the ends
    bend = bernstein(7, s) * (72.0 / (duration**2 * limits.gravity))
    effort = Affine(*(np.diff(part, 2) for part in points)).mixed(bend).plus(2, 1.0)
    above = points.plus(2, -limits.clearance).mixed(bernstein(9, s) / SCALE).plus(2, 1.0 / SCALE)
    least, most = limits.effort
    pushed = effort.mapped(np.eye(4, 3, -1)).plus(0, most)
    upright = effort.mapped(_cone(np.sin(limits.tilt), np.cos(limits.tilt)))
    glides = above.mapped(_cone(1.0, limits.glide_slope))
    cones = pushed.beside(upright).beside(glides).plus(0, -ROOM)
    share = 0.5 * (np.diff(s, prepend=0.0) + np.diff(s, append=1.0))
    x, excess = cone_program.least(effort, share, least + ROOM, cones)
    size = np.sqrt((effort.at(x) ** 2).sum(axis=0))
    return points.at(x).T, duration * ((share * size).sum() + cone_program.PENALTY * excess)


def _cone(up: float, aside: float) -> Array:
    """Return the matrix (4, 3) to (up z, aside x, aside y, 0): a cone about the vertical."""
    return np.array([[0.0, 0.0, up], [aside, 0.0, 0.0], [0.0, aside, 0.0], [0.0, 0.0, 0.0]])
