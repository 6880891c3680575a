"""A descent to the Moon along a Bezier curve, and the planning of the one that burns least.

World axes as in ``descent``. The curve is in (along, across, up), with ``along`` horizontal at
``azimuth``.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mjspace.algebra import times
from mjspace.contract import Array, Trajectory, gain

from .bezier import curve
from .descent import powered
from .descent_limits import Limits, keeps, least_propellant, shortest_duration
from .lander_gains import LunarGravity

EXHAUST_SPEED = 320.0 * 9.80665
"""Isp g0 of the lander's engine [m/s]."""
TABLE_3 = (
    (2500.0, 0.0, 1000.0),
    (2288.411, -61.714, 911.838),
    (2076.821, -123.427, 754.06),
    (1865.232, -185.141, 337.472),
    (522.683, 81.009, 1588.088),
    (1169.953, -199.488, -701.893),
    (0.0, 0.0, 614.185),
    (0.0, 0.0, -47.556),
    (0.0, 0.0, 6.408),
    (0.0, 0.0, 2.0),
)
"""Control points [m] that ``plan`` finds from the start of paper 003's table 3, for 79.346 s."""
PACE = 1.15
"""Ratio of successive durations in the coarse search of ``plan``."""


@dataclass(frozen=True)
class BezierDescent(LunarGravity):
    """A Bezier curve to a point above the site, then a descent at its final speed, without end.

    The default starts as in paper 003's table 3 and burns 5.13 kg within 70 to 270 N and 45 deg of
    tilt; the paper's own descent needs 10.7 kg.
    """

    duration: float = gain("s", default=79.346, above=0.0)
    """T: duration of the curve."""
    points: Array = gain("m", (None, 3), default=TABLE_3)
    """Control points, (along, across, up) from the site; n + 1 rows for degree n."""
    azimuth: float = gain("rad", default=0.6435, at_least=-2.0 * np.pi, at_most=2.0 * np.pi)
    """Direction of ``along``, from x towards y."""
    stance: float = gain("m", default=1.8, at_least=0.0)
    """Height of the body origin above the ground when the vehicle stands."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.points) < 5:
            raise ValueError(f"points: got {len(self.points)} rows, should be 5 or more")

    def at(self, time: Array) -> Trajectory:
        """Return the motion at each ``time`` (n,) [s]."""
        late = np.maximum(time - self.duration, 0.0)
        motion = curve(self.points, self.duration, np.minimum(time / self.duration, 1.0))
        motion[0] += late[:, None] * motion[1]
        for part in motion[2:]:
            part[late > 0.0] = 0.0
        c, s = np.cos(self.azimuth), np.sin(self.azimuth)
        to_world = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        motion = [times(to_world, part) for part in motion]
        motion[0] += np.array([0.0, 0.0, self.stance])
        return powered(motion, self.azimuth, self.gravity_parameter, self.moon_radius)


def plan(
    place: Array,
    velocity: Array,
    *,
    mass: float = 100.0,
    gravity: float = 1.62283,
    thrust_range: tuple[float, float] = (70.0, 270.0),
    tilt_limit: float = np.radians(45.0),
    glide_slope: float = 0.15,
    clearance: float = 2.0,
    descent_speed: float = 0.5,
) -> tuple[float, Array]:
    """Return the duration [s] and the control points (10, 3) [m] that burn least.

    The descent starts at ``place`` [m] with ``velocity`` [m/s], both (3,) in (along, across, up),
    and ends at ``clearance`` [m] above the site with ``descent_speed`` [m/s]; at both ends the
    vehicle is upright and does not rotate. In between the thrust stays within ``thrust_range`` [N]
    and within ``tilt_limit`` [rad] of the vertical, and the height above ``glide_slope`` times the
    horizontal distance, less a metre. Flat ground, constant ``mass`` [kg].

    Hovering burns propellant in proportion to time, so the best descent is short: it falls first
    and brakes late, at nearly full thrust. Durations are tried from the lower bound
    ``shortest_duration`` to that of a mean speed of ``descent_speed``, but no longer than the
    gravity losses of the best one so far allow.

    Raises:
        ValueError: no descent within the limits was found.
    """
    limits = Limits(mass, gravity, thrust_range, tilt_limit, glide_slope, clearance, descent_speed)
    refused = f"no descent from {place} m at {velocity} m/s"
    way = place - limits.end
    if way[2] + 1.0 < glide_slope * np.hypot(way[0], way[1]):
        raise ValueError(f"{refused}: it starts below the glide slope")
    shortest = shortest_duration(way[2], -velocity[2], limits)
    longest = float(np.sqrt((way**2).sum())) / descent_speed
    if not np.isfinite(shortest):
        raise ValueError(f"{refused}: full thrust does not brake it above the ground")

    def cost(duration: float) -> float:
        return least_propellant(duration, place, velocity, limits)[1]

    costs: dict[float, float] = {}
    duration = max(shortest, 1.0)
    while duration <= longest:
        costs[duration] = cost(duration)
        duration *= PACE
        # Thrust over weight, summed over time, is at least this time plus the gain in speed.
        if duration - (descent_speed + velocity[2]) / gravity > min(costs.values()):
            break
    if not costs:
        raise ValueError(f"{refused} lasts between {shortest:.4g} and {longest:.4g} s")
    best = min(costs, key=lambda duration: costs[duration])
    duration = _golden(cost, max(best / PACE, shortest), min(best * PACE, longest))
    points = least_propellant(duration, place, velocity, limits)[0]
    if not keeps(points, duration, place, velocity, limits):
        raise ValueError(f"{refused} of {shortest:.4g} to {longest:.4g} s keeps within the limits")
    return duration, points


def burnt(thrust: Array, time: Array) -> float:
    """Return the propellant burnt [kg] by ``thrust`` [N] at each ``time`` [s], both (n,)."""
    return float(np.trapezoid(thrust, time)) / EXHAUST_SPEED


def _golden(cost: Callable[[float], float], low: float, high: float) -> float:
    """Return the duration [s] of least ``cost``, to 0.05 s, by golden-section search."""
    ratio = (np.sqrt(5.0) - 1.0) / 2.0
    a, b = high - ratio * (high - low), low + ratio * (high - low)
    cost_a, cost_b = cost(a), cost(b)
    while high - low > 0.05:
        if cost_a < cost_b:
            high, b, cost_b = b, a, cost_a
            a = high - ratio * (high - low)
            cost_a = cost(a)
        else:
            low, a, cost_a = a, b, cost_b
            b = low + ratio * (high - low)
            cost_b = cost(b)
    return float(0.5 * (low + high))
