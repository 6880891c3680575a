"""A descent to the Moon that saves propellant: a Bezier curve, and the plan that finds it.

What a hovering engine burns goes with time, so the thriftiest descent is a short one: it drops
first, and brakes late, at nearly full thrust. World axes as in ``descent``; the curve is given in
(along, across, up), with ``along`` horizontal at ``azimuth``.
"""

from dataclasses import dataclass
from math import comb

import numpy as np
from scipy.optimize import minimize

from mjspace.contract import Array, Gains, Trajectory, gain

from .descent import powered

EXHAUST_SPEED = 320.0 * 9.80665
"""Isp g0 of the lander's engine [m/s]."""
TABLE_3 = (
    (2500.0, 0.0, 1000.0),
    (2288.601, -61.658, 911.917),
    (2077.201, -123.316, 750.446),
    (1865.802, -184.975, 356.944),
    (524.439, 82.271, 1575.039),
    (1169.866, -199.81, -693.676),
    (0.0, 0.0, 612.74),
    (0.0, 0.0, -45.805),
    (0.0, 0.0, 6.404),
    (0.0, 0.0, 2.0),
)
"""What ``plan`` finds for the start of paper 003's table 3 [m], to be flown in 79.275 s."""


@dataclass(frozen=True)
class BezierDescent(Gains):
    """A Bezier curve to above the site, then down at its last speed, without end.

    By default it starts as in paper 003's table 3 and burns 5.13 kg within 70 and 270 N and 45 deg
    of tilt, where the paper's own descent needs 10.7 kg.
    """

    duration: float = gain("s", default=79.275, above=0.0)
    """T, of the curve."""
    points: Array = gain("m", (None, 3), default=TABLE_3)
    """Control points, (along, across, up) from the site, n + 1 rows for degree n."""
    azimuth: float = gain("rad", default=0.6435, at_least=-2.0 * np.pi, at_most=2.0 * np.pi)
    """Of ``along``, from x towards y."""
    stance: float = gain("m", default=1.8, at_least=0.0)
    """Of the vehicle's origin above the ground when it stands."""
    gravity_parameter: float = gain("m^3/s^2", default=4.902e12, above=0.0)
    """mu of the Moon."""
    moon_radius: float = gain("m", default=1.738e6, above=0.0)
    """Of the landing plane, tangent there."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.points) < 5:
            raise ValueError(f"points has {len(self.points)} rows: 5 or more would do")

    def at(self, time: Array) -> Trajectory:
        """Return the descent at each ``time`` [s]."""
        late = np.maximum(time - self.duration, 0.0)[:, None]
        motion = curve(self.points, self.duration, np.clip(time / self.duration, 0.0, 1.0))
        motion[0] = motion[0] + late * motion[1]
        for part in motion[2:]:
            part[late[:, 0] > 0.0] = 0.0
        c, s = np.cos(self.azimuth), np.sin(self.azimuth)
        to_world = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        motion = [part @ to_world for part in motion]
        motion[0] += np.array([0.0, 0.0, self.stance])
        return powered(motion, self.azimuth, self.gravity_parameter, self.moon_radius)


def curve(points: Array, duration: float, s: Array) -> list[Array]:
    """Return a Bezier curve and its first four derivatives by time at ``s``, 0 to 1: (n, 3) each.

    ``points`` (k, 3) [m] are passed in ``duration`` [s].
    """
    found, corners = [], points
    for _ in range(5):
        found.append(_blend(len(corners) - 1, s) @ corners)
        corners = np.diff(corners, axis=0) * ((len(corners) - 1) / duration)
    return found


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
    """Return the duration [s] and the points (10, 3) [m] that burn least.

    ``place`` and ``velocity``, (along, across, up), are where the descent starts, upright and not
    turning, and so it ends, ``clearance`` [m] up and descending. In between the thrust stays in
    ``thrust_range`` [N] and within ``tilt_limit`` [rad] of the vertical, and the vehicle above
    ``glide_slope`` times its distance, less a metre. Flat ground, ``mass`` [kg] constant.

    Raises:
        ValueError: no such descent was found.
    """
    s = np.linspace(0.0, 1.0, 101)
    blend, bend = _blend(9, s), _blend(7, s)
    end, last = np.array([0.0, 0.0, clearance]), np.array([0.0, 0.0, -descent_speed])

    def points_of(x: Array) -> tuple[float, Array]:
        # Evenly spaced points: no horizontal acceleration and jerk, hence no tilt and no rate.
        duration, ends = 10.0 * x[0], np.arange(4)[:, None] * (10.0 * x[0] / 9.0)
        sides = 100.0 * x[1:5].reshape(2, 2)
        points = np.empty((10, 3))
        points[:4], points[:5:-1] = place + ends * velocity, end - ends * last
        points[4:6, :2], points[2:8, 2] = sides, 100.0 * x[5:]
        return duration, points

    def force(x: Array) -> Array:
        duration, points = points_of(x)
        felt = bend @ np.diff(points, 2, axis=0) * (72.0 / duration**2)
        felt[:, 2] += gravity
        return mass * felt

    def propellant(x: Array) -> float:
        return burnt(np.linalg.norm(force(x), axis=-1), 10.0 * x[0] * s)

    def margins(x: Array) -> Array:
        pushed, seen = force(x), blend @ points_of(x)[1]
        size = np.linalg.norm(pushed, axis=-1)
        upright = pushed[:, 2] - np.cos(tilt_limit) * size
        above = seen[:, 2] - end[2] + 1.0 - glide_slope * np.hypot(seen[:, 0], seen[:, 1])
        limits = [size - thrust_range[0], thrust_range[1] - size, upright, above]
        return 0.01 * np.concatenate(limits)

    way = np.linspace(0.8, 0.2, 2)[:, None] * place[:2]
    start = np.concatenate([way.ravel(), np.linspace(0.8, 0.1, 6) * place[2]])
    guess = np.concatenate([[10.0], 0.01 * start])
    within = {"type": "ineq", "fun": margins}
    found = minimize(
        propellant, guess, method="SLSQP", constraints=within, options={"maxiter": 300}
    )
    if not found.success or margins(found.x).min() < -1e-6:
        raise ValueError(f"no descent from {place} m at {velocity} m/s: {found.message}")
    return points_of(found.x)


def burnt(thrust: Array, time: Array) -> float:
    """Return the propellant [kg] that ``thrust`` [N] at each ``time`` [s] burns, both (n,)."""
    return float(np.trapezoid(thrust, time)) / EXHAUST_SPEED


def _blend(degree: int, s: Array) -> Array:
    """Return Bernstein's polynomials at ``s`` (n,), shape (n, degree + 1)."""
    terms = [comb(degree, k) * s**k * (1.0 - s) ** (degree - k) for k in range(degree + 1)]
    return np.stack(terms, axis=-1)
