"""Thrust vectoring for a lander: position by tilt and thrust, tilt by the engine's gimbals.

Unlike paper 003's law it can follow a fast descent with large tilt: it feeds forward the
reference's acceleration, rate and angular acceleration. Axes as in ``lander``. The rotation about
the thrust is not controlled, since a gimballed engine has no torque about it. All arrays may have
leading vehicle axes.
"""

# mypy: disable-error-code="no-untyped-call"
from dataclasses import dataclass
from functools import cached_property
from math import asin, cos, hypot, sqrt
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numba import njit

from mjspace.contract import Array, Measurement, ThrustCommand, Trajectory, gain
from mjspace.gufunc import gufunc

from .lander import burning, touched
from .lander_gains import GimballedEngine


class State(NamedTuple):
    """Memory of the law: whether the engine was cut, and the integral of the position error."""

    cut: Array
    """1.0 from touchdown on, when the engine is cut for good, else 0.0; (..., 1)."""
    integral: Array
    """Of the position error, clipped at ``integral_reach`` [m s], world axes, (..., 3)."""


class Signals(NamedTuple):
    """Signals of the law."""

    position_error: Array
    """Measured less desired position [m], world axes, (..., 3)."""
    pointing_error: Array
    """Sine of the rotation from the thrust axis to the desired one [rad], body x and y, (..., 2).
    """
    desired_thrust: Array
    """Commanded thrust before its limits [N], (..., 1)."""
    desired_gimbal: Array
    """Commanded gimbal angles before their limits, outer and inner [rad], (..., 2)."""


@dataclass(frozen=True, kw_only=True)
class ThrustVectoring(GimballedEngine):
    """Three loops, each faster than the one around it: position, tilt, rate.

    f = a_d + g - kd e' - kp e - ki (integral of e) is the desired thrust over mass. n = f / |f| is
    tracked with the rate w = R^T w_d + ka z x n, and w with the torque
    J (w_d' + kw (w - rate)) + rate x J rate. The thrust is m f along the vehicle's z axis.
    """

    batched: ClassVar[bool] = True

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    position_gain: float = gain("1/s^2", default=0.04, above=0.0)
    """kp."""
    velocity_gain: float = gain("1/s", default=0.32, above=0.0)
    """kd."""
    integral_gain: float = gain("1/s^3", default=0.002, at_least=0.0)
    """ki: compensates an error of the mass m."""
    integral_reach: float = gain("m", default=1.0, above=0.0)
    """Largest position error that is integrated; larger ones are clipped."""
    feedback_limit: float = gain("m/s^2", default=0.3, above=0.0)
    """Limit of kd e' + kp e: below the thrust margin that the desired motion leaves."""
    pointing_gain: float = gain("1/s", default=1.0, above=0.0)
    """ka."""
    turn_limit: float = gain("rad/s", default=0.1, above=0.0)
    """Limit of ka z x n: a rate that a throttled engine on slow gimbals can still stop."""
    rate_gain: float = gain("1/s", default=2.0, above=0.0)
    """kw."""
    tilt_limit: float = gain("rad", default=np.radians(60.0), above=0.0, below=0.5 * np.pi)
    """Largest tilt of the thrust from the vertical; the horizontal thrust is reduced to keep it."""
    inertia: Array = gain("kg m^2", (3, 3), default=np.diag([90.0, 80.0, 100.0]), form="inertia")
    """J: about the centre of mass, body axes."""
    lever: float = gain("m", default=1.0, above=0.0)
    """Distance of the gimbals below the centre of mass."""
    thrust_range: Array = gain("N", (2,), default=(50.0, 320.0), above=0.0, at_most=np.inf)
    """Least and largest thrust; the least divides the torque, so it is not zero."""

    def __post_init__(self) -> None:
        super().__post_init__()
        stable = self.position_gain * self.velocity_gain  # Routh
        if not self.integral_gain < stable:
            raise ValueError(
                f"integral_gain: got {self.integral_gain:g} 1/s^3, should be less than "
                f"position_gain velocity_gain = {stable:g}"
            )

    def reset(self, measurement: Measurement, reference: Trajectory) -> State:
        """Return the initial state: the engine is not cut, the integral is zero."""
        position = measurement.position
        return State(np.zeros_like(position[..., :1]), np.zeros_like(position))

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Trajectory
    ) -> tuple[State, ThrustCommand, Signals]:
        """Return the next state, the thrust and gimbal angles, and the errors."""
        cut = touched(state.cut, measurement)
        at = measurement
        error, pointing, commanded, limited, integral = _law.ufunc(
            at.attitude, at.rate, at.position, at.velocity,
            *reference, state.integral, self.inertia, self._gains,
        )  # fmt: skip
        signals = Signals(error, pointing[..., :2], commanded[..., :1], commanded[..., :0:-1])
        return State(cut, integral), burning(cut, limited), signals

    @cached_property
    def _gains(self) -> Array:
        loops = [self.position_gain, self.velocity_gain, self.pointing_gain, self.rate_gain]
        limits = [self.turn_limit, np.tan(self.tilt_limit), self.feedback_limit]
        engine = [self.mass, self.lever, *self.thrust_range, self.gimbal_limit]
        moon = [self.gravity_parameter, self.moon_radius]
        integral = [self.integral_gain, self.integral_reach, self.control_period]
        return np.array([*loops, *limits, *integral, *engine, *moon])


@njit
def _clipped(value: Any, low: Any, high: Any) -> Any:
    """Return ``value`` within limits; NaN stays NaN."""
    if value < low:
        return low
    if value > high:
        return high
    return value


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
def _desired_force(p: Any, v: Any, p_d: Any, v_d: Any, a_d: Any, integral: Any, gains: Any) -> Any:
    """Return the desired thrust over mass [m/s^2], world axes, (3,)."""
    kp, kd, _, _, _, tilt_slope, most, ki, _, _, m, _, least, _, _, mu, radius = gains
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
    share = tilt_slope * f[2] / max(side, tilt_slope * f[2])
    return share * f[0], share * f[1], f[2]


@gufunc(
    [f"void({'f8[:],' * 11}f8[:,:],{'f8[:],' * 5}f8[:])"],
    "(q),(v),(v),(v),(q),(v),(v),(v),(v),(v),(v),(v,v),(g)->(v),(v),(v),(v),(v)",
)
def _law(
    q: Any, w: Any, p: Any, v: Any, q_d: Any, w_d: Any, dw_d: Any, p_d: Any, v_d: Any, a_d: Any,
    before: Any, J: Any, gains: Any,
    error: Any, pointing: Any, commanded: Any, limited: Any, integral: Any,
) -> None:  # fmt: skip
    """Write the errors, [F, b1, b2] before and within the engine's limits, and the integral."""
    _, _, ka, kw, rate_limit, _, _, _, reach, period, m, lever, least, most, swing, _, _ = gains
    for i in range(3):
        error[i] = p[i] - p_d[i]
        integral[i] = before[i] + period * _clipped(error[i], -reach, reach)
    f = _to_body(q, _desired_force(p, v, p_d, v_d, a_d, before, gains))
    size = sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2])
    pointing[0], pointing[1], pointing[2] = -f[1] / size, f[0] / size, 0.0
    share = rate_limit / max(ka * hypot(pointing[0], pointing[1]), rate_limit)

    # R^T R_d: the reference's rates are in the desired axes.
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

    commanded[0] = m * f[2]
    limited[0] = _clipped(commanded[0], least, most)
    # Torque = lever F (sin b1, -cos b1 sin b2, 0).
    commanded[1] = asin(_clipped(torque_x / (lever * limited[0]), -1.0, 1.0))
    commanded[2] = -asin(_clipped(torque_y / (lever * limited[0] * cos(commanded[1])), -1.0, 1.0))
    limited[1] = _clipped(commanded[1], -swing, swing)
    limited[2] = _clipped(commanded[2], -swing, swing)
