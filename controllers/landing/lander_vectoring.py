"""Thrust vectoring for a lander: position by tilt and thrust, tilt by the engine's gimbals.

Unlike paper 003's law it can follow a fast descent with large tilt: it feeds forward the
reference's acceleration, rate and angular acceleration. Axes as in ``lander``. The rotation about
the thrust is not controlled, since a gimballed engine has no torque about it. All arrays may have
leading vehicle axes.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross, dot, times
from mjspace.attitude import conjugate, multiply, rotate
from mjspace.contract import Array, Measurement, ThrustCommand, Trajectory, gain

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
        error = measurement.position - reference.position
        pointing, thrust, torque = self._wanted(state.integral, measurement, reference)
        commanded = self._deflected(thrust, torque)

        integrated = np.clip(error, -self.integral_reach, self.integral_reach)
        cut = touched(state.cut, measurement)
        after = State(cut, state.integral + self.control_period * integrated)
        signals = Signals(error, pointing[..., :2], commanded[..., :1], commanded[..., :0:-1])
        return after, burning(cut, self.limited(commanded)), signals

    def _deflected(self, thrust: Array, torque: Array) -> Array:
        """Return thrust and gimbal angles [F, b1, b2] [N, rad] that give a torque, (..., 3)."""
        # The torque is lever F (sin b1, -cos b1 sin b2, 0).
        lever = self.lever * np.clip(thrust, *self.thrust_range)
        b1 = np.arcsin(np.clip(torque[..., :1] / lever, -1.0, 1.0))
        b2 = -np.arcsin(np.clip(torque[..., 1:2] / (lever * np.cos(b1)), -1.0, 1.0))
        return np.concatenate([thrust, b1, b2], axis=-1)

    def _wanted(
        self, integral: Array, measurement: Measurement, reference: Trajectory
    ) -> tuple[Array, Array, Array]:
        """Return the pointing error, the thrust [N] and the torque [N m], body axes."""
        force = self._desired_force(measurement, reference, integral)
        return self._steered(force, measurement, reference)

    def _steered(
        self, force: Array, at: Measurement, desired: Trajectory
    ) -> tuple[Array, Array, Array]:
        """Return what ``_wanted`` does for a desired thrust over mass [m/s^2], world axes."""
        w = at.rate
        to_body = conjugate(at.attitude)
        f = rotate(to_body, force)
        pointing = cross(_THRUST_AXIS, f) / np.sqrt(dot(f, f))

        from_desired = multiply(to_body, desired.attitude)
        turn = shortened(self.pointing_gain * pointing, self.turn_limit)
        rate = rotate(from_desired, desired.rate) + turn
        spin = rotate(from_desired, desired.acceleration) + self.rate_gain * (rate - w)
        torque = times(self.inertia, spin) + cross(w, times(self.inertia, w))
        return pointing, self.mass_with(at.propellant) * f[..., 2:], torque

    def _desired_force(
        self, measurement: Measurement, reference: Trajectory, integral: Array
    ) -> Array:
        """Return f [m/s^2], world axes, (..., 3), within its limits."""
        position_error = measurement.position - reference.position
        velocity_error = measurement.velocity - reference.velocity
        feedback = self.velocity_gain * velocity_error + self.position_gain * position_error
        f = reference.linear_acceleration - self.gravity(measurement.position)
        f = f - shortened(feedback, self.feedback_limit) - self.integral_gain * integral
        return self._upright(f, measurement.propellant)

    def _upright(self, f: Array, propellant: Array) -> Array:
        """Return a thrust over mass [m/s^2] that points up within the tilt limit, (..., 3)."""
        up = np.maximum(f[..., 2:], self.thrust_range[0] / self.mass_with(propellant))
        aside = shortened(f[..., :2], np.tan(self.tilt_limit) * up)
        return np.concatenate([aside, up], axis=-1)


_THRUST_AXIS = np.array([0.0, 0.0, 1.0])


def shortened(vector: Array, longest: Array | float) -> Array:
    """Return the ``vector`` with a length of at most ``longest``, a number or (..., 1)."""
    return longest / np.maximum(np.sqrt(dot(vector, vector)), longest) * vector
