"""Thrust vectoring for a lander: its place by tilt and thrust, its tilt by the engine's gimbals.

What paper 003's law cannot do: follow a descent that is quick and tilts far, by feeding forward the
acceleration, the rate and the angular acceleration that the reference wants. Axes as in ``lander``.
The turn about the thrust is left alone, for which an engine on gimbals has no torque. All arrays
may have leading vehicle axes.
"""

# mypy: disable-error-code="no-untyped-call"
from dataclasses import dataclass
from functools import cached_property
from math import asin, cos, hypot, sqrt
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numba import guvectorize, njit

from mjspace.contract import Array, Gains, Measurement, ThrustCommand, Trajectory, gain

from .lander import burning, touched
from .lander_kernels import clipped


class State(NamedTuple):
    """Memory: whether the ground was touched, and a lasting error."""

    cut: Array
    """1.0 once the engine is cut, for good, (..., 1)."""
    integral: Array
    """Of the position error, cut at ``integral_reach`` [m s], world axes, (..., 3)."""


class Signals(NamedTuple):
    """What the law shows."""

    position_error: Array
    """Position less the wanted one [m], world axes, (..., 3)."""
    pointing_error: Array
    """The thrust's axis turned towards the wanted one [rad], body x and y, (..., 2): its sine."""
    wanted_thrust: Array
    """Before the limits [N], (..., 1)."""
    wanted_gimbal: Array
    """Before the limits, outer and inner [rad], (..., 2)."""


@dataclass(frozen=True)
class ThrustVectoring(Gains):
    """Three loops, each quicker than the one around it: place, tilt, rate.

    f = a_d + g - kd e' - kp e - ki (integral of e) is the wanted thrust over mass; n = f / |f| is
    followed with the rate w = R^T w_d + ka z x n, and that with the torque
    J (w_d' + kw (w - rate)) + rate x J rate. The thrust is m f along the vehicle's own axis.
    """

    batched: ClassVar[bool] = True

    control_period: float = gain("s", above=0.0)
    """Of ``step``."""
    position_gain: float = gain("1/s^2", default=0.04, above=0.0)
    """kp."""
    velocity_gain: float = gain("1/s", default=0.32, above=0.0)
    """kd."""
    integral_gain: float = gain("1/s^3", default=0.002, at_least=0.0)
    """ki: against a mass other than m."""
    integral_reach: float = gain("m", default=1.0, above=0.0)
    """A larger error counts as this in the integral."""
    feedback_limit: float = gain("m/s^2", default=0.3, above=0.0)
    """Of kd e' + kp e: less than what the wanted motion leaves of the thrust."""
    pointing_gain: float = gain("1/s", default=1.0, above=0.0)
    """ka."""
    turn_limit: float = gain("rad/s", default=0.1, above=0.0)
    """Of ka z x n: what a throttled engine on slow gimbals can stop again."""
    rate_gain: float = gain("1/s", default=2.0, above=0.0)
    """kw."""
    tilt_limit: float = gain("rad", default=np.radians(60.0), above=0.0, below=0.5 * np.pi)
    """How far from the vertical it may point; less horizontal thrust is asked for, then."""
    mass: float = gain("kg", default=100.0, above=0.0)
    """m."""
    inertia: Array = gain("kg m^2", (3, 3), default=np.diag([90.0, 80.0, 100.0]), form="inertia")
    """J, about the centre of mass, body axes."""
    lever: float = gain("m", default=1.0, above=0.0)
    """How far the gimbals are below the centre of mass."""
    thrust_range: Array = gain("N", (2,), default=(50.0, 320.0), above=0.0, at_most=np.inf)
    """Least, without which no torque is left, and largest."""
    gimbal_limit: float = gain("rad", default=np.radians(20.0), above=0.0, at_most=np.pi)
    """Of either angle."""
    gravity_parameter: float = gain("m^3/s^2", default=4.902e12, above=0.0)
    """mu of the Moon."""
    moon_radius: float = gain("m", default=1.738e6, above=0.0)
    """Of the landing site."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (np.inf > self.thrust_range[0] <= self.thrust_range[1]):
            raise ValueError(
                f"thrust_range: got {self.thrust_range} N, should be the least, then the largest"
            )
        stable = self.position_gain * self.velocity_gain  # Routh
        if not self.integral_gain < stable:
            raise ValueError(
                f"integral_gain: got {self.integral_gain:g} 1/s^3, should be less than "
                f"position_gain velocity_gain = {stable:g}"
            )

    def reset(self, measurement: Measurement, reference: Trajectory) -> State:
        """Return the state of an engine that burns."""
        place = measurement.position
        return State(np.zeros_like(place[..., :1]), np.zeros_like(place))

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Trajectory
    ) -> tuple[State, ThrustCommand, Signals]:
        """Return the state, the thrust with the gimbals' angles, and the errors."""
        cut = touched(state.cut, measurement)
        seen = measurement
        error, pointing, asked, given, integral = _law(
            seen.attitude, seen.rate, seen.position, seen.velocity,
            *reference, state.integral, self.inertia, self._gains,
        )  # fmt: skip
        shown = Signals(error, pointing[..., :2], asked[..., :1], asked[..., :0:-1])
        return State(cut, integral), burning(cut, given), shown

    @cached_property
    def _gains(self) -> Array:
        loops = [self.position_gain, self.velocity_gain, self.pointing_gain, self.rate_gain]
        limits = [self.turn_limit, np.tan(self.tilt_limit), self.feedback_limit]
        engine = [self.mass, self.lever, *self.thrust_range, self.gimbal_limit]
        moon = [self.gravity_parameter, self.moon_radius]
        lasting = [self.integral_gain, self.integral_reach, self.control_period]
        return np.array([*loops, *limits, *lasting, *engine, *moon])


@njit
def _to_body(q: Any, v: Any) -> Any:
    """Return R(q)^T v."""
    q0, x, y, z = q
    # v - q0 t + q_v x t with t = 2 q_v x v.
    t = 2.0 * (y * v[2] - z * v[1]), 2.0 * (z * v[0] - x * v[2]), 2.0 * (x * v[1] - y * v[0])
    return (
        v[0] - q0 * t[0] + y * t[2] - z * t[1],
        v[1] - q0 * t[1] + z * t[0] - x * t[2],
        v[2] - q0 * t[2] + x * t[1] - y * t[0],
    )


@njit
def _wanted_force(p: Any, v: Any, p_d: Any, v_d: Any, a_d: Any, integral: Any, gains: Any) -> Any:
    """Return the wanted thrust over mass [m/s^2], world axes."""
    kp, kd, _, _, _, steepest, most, ki, _, _, m, _, least, _, _, mu, radius = gains
    away = (p[0], p[1], radius + p[2])
    square = away[0] * away[0] + away[1] * away[1] + away[2] * away[2]
    pull = mu / (square * sqrt(square))
    back, f = np.empty(3), np.empty(3)
    for i in range(3):
        back[i] = kd * (v[i] - v_d[i]) + kp * (p[i] - p_d[i])
    size = sqrt(back[0] * back[0] + back[1] * back[1] + back[2] * back[2])
    share = most / max(size, most)
    for i in range(3):
        f[i] = a_d[i] + pull * away[i] - share * back[i] - ki * integral[i]
    if f[2] < least / m:
        f[2] = least / m
    side = hypot(f[0], f[1])
    share = steepest * f[2] / max(side, steepest * f[2])
    return share * f[0], share * f[1], f[2]


@guvectorize(
    [f"void({'f8[:],' * 11}f8[:,:],{'f8[:],' * 5}f8[:])"],
    "(q),(v),(v),(v),(q),(v),(v),(v),(v),(v),(v),(v,v),(g)->(v),(v),(v),(v),(v)",
    cache=True,
)
def _law(
    q: Any, w: Any, p: Any, v: Any, q_d: Any, w_d: Any, dw_d: Any, p_d: Any, v_d: Any, a_d: Any,
    before: Any, J: Any, gains: Any,
    error: Any, pointing: Any, asked: Any, given: Any, integral: Any,
) -> None:  # fmt: skip
    """Write the errors, [F, b1, b2] as wanted and within the engine's limits, and the integral."""
    _, _, ka, kw, quickest, _, _, _, reach, period, m, lever, least, most, swing, _, _ = gains
    for i in range(3):
        error[i] = p[i] - p_d[i]
        integral[i] = before[i] + period * clipped(error[i], -reach, reach)
    f = _to_body(q, _wanted_force(p, v, p_d, v_d, a_d, before, gains))
    size = sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2])
    pointing[0], pointing[1], pointing[2] = -f[1] / size, f[0] / size, 0.0
    share = quickest / max(ka * hypot(pointing[0], pointing[1]), quickest)

    # R^T R_d: the reference's rates are in its own axes.
    back = (q_d[0], -q_d[1], -q_d[2], -q_d[3])
    rate_d = _to_body(q, _to_body(back, w_d))
    spin_d = _to_body(q, _to_body(back, dw_d))
    a = np.empty(3)
    for i in range(3):
        a[i] = spin_d[i] + kw * (rate_d[i] + share * ka * pointing[i] - w[i])
    h = np.empty(3)
    for i in range(3):
        h[i] = J[i, 0] * w[0] + J[i, 1] * w[1] + J[i, 2] * w[2]
    torque_x = J[0, 0] * a[0] + J[0, 1] * a[1] + w[1] * h[2] - w[2] * h[1]
    torque_y = J[1, 0] * a[0] + J[1, 1] * a[1] + w[2] * h[0] - w[0] * h[2]

    asked[0] = m * f[2]
    given[0] = clipped(asked[0], least, most)
    # Torque = lever F (sin b1, -cos b1 sin b2, 0).
    asked[1] = asin(clipped(torque_x / (lever * given[0]), -1.0, 1.0))
    asked[2] = -asin(clipped(torque_y / (lever * given[0] * cos(asked[1])), -1.0, 1.0))
    given[1] = clipped(asked[1], -swing, swing)
    given[2] = clipped(asked[2], -swing, swing)
