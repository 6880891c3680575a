"""Over-actuated landing: PID for position and attitude, by one fixed engine and many thrusters.

What paper 003 sets its one gimballed engine against: "a total of 29 actuators, one main engine of
adjustable thrust" and the thrusters of a reaction-control system, under PID (its introduction, of
Chang'e 3 and 4). The engine pushes along the body's z axis with the PID's force there; thrusters
give the force across it and all torque, so that the vehicle need not lean to move aside. Axes as in
``lander``. All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from mjspace.algebra import cross, times
from mjspace.attitude import conjugate, multiply, rotate
from mjspace.contract import Array, Measurement, Reference, Trajectory, gain

from ..attitude.turn import turn
from ..thrusters.allocation import effect, pulses, share, within
from .lander import touched
from .lander_gains import GimballedEngine
from .lander_takeover import Command
from .lander_vectoring import shortened


class State(NamedTuple):
    """Memory of the law."""

    cut: Array
    """1.0 from touchdown on, when engine and thrusters are shut for good, else 0.0; (..., 1)."""
    integral: Array
    """Of the position error [m s], world axes, (..., 3)."""
    angle_integral: Array
    """Of the attitude error [rad s], body axes, (..., 3)."""
    carry: Array
    """On-time of each thruster that is carried over [s], (..., n)."""


class Signals(NamedTuple):
    """Signals of the law."""

    position_error: Array
    """Measured less desired position [m], world axes, (..., 3)."""
    angle_error: Array
    """Rotation vector from the desired to the measured attitude [rad], body axes, (..., 3)."""
    desired_thrust: Array
    """Commanded thrust of the engine before its limits [N], (..., 1)."""
    desired_force: Array
    """Of the thrusters [N], body axes, (..., 3)."""
    desired_torque: Array
    """Of the thrusters [N m], body axes, (..., 3)."""


@dataclass(frozen=True, kw_only=True)
class OverActuated(GimballedEngine):
    """Two PID laws, each with the acceleration of the desired motion fed forward.

    f = a_d + g - kd e' - kp e - ki (integral of e) is the desired force over mass, torque
    J (w_d' - kd slip - kp angle - ki (integral of angle)) + w x J w. Thrusters are allocated by
    non-negative least squares and pulsed.
    """

    batched: ClassVar[bool] = True

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """J: of the whole vehicle, about its centre of mass, body axes."""
    thruster_positions: Array = gain("m", ("thruster", 3))
    """From the centre of mass, body axes, (n, 3)."""
    thruster_directions: Array = gain(shape=("thruster", 3), form="unit vector")
    """Of the force on the vehicle, body axes, (n, 3)."""
    thruster_force: Array = gain("N", ("thruster",), above=0.0)
    """Of each, (n,)."""
    thruster_minimum_on: Array | float = gain(
        "s", ("thruster",), default=0.0, at_least=0.0, one_for_all=True
    )
    """Shorter pulses are not fired but carried over; of all, or of each, (n,)."""
    position_gain: float = gain("1/s^2", default=0.04, above=0.0)
    """kp of the position."""
    velocity_gain: float = gain("1/s", default=0.32, above=0.0)
    """kd of the position."""
    integral_gain: float = gain("1/s^3", default=0.002, at_least=0.0)
    """ki of the position."""
    integral_reach: float = gain("m", default=1.0, above=0.0)
    """Largest position error that is integrated; larger ones are clipped."""
    feedback_limit: float = gain("m/s^2", default=0.3, above=0.0)
    """Limit of kd e' + kp e."""
    force_limit: float = gain("N", default=40.0, above=0.0)
    """Of the thrusters' force across the engine's axis: what they have beside the torque."""
    attitude_gain: float = gain("1/s^2", default=1.0, above=0.0)
    """kp of the attitude."""
    rate_gain: float = gain("1/s", default=2.0, above=0.0)
    """kd of the attitude."""
    attitude_integral_gain: float = gain("1/s^3", default=0.1, at_least=0.0)
    """ki of the attitude."""
    angle_reach: float = gain("rad", default=0.02, above=0.0)
    """Largest attitude error that is integrated; larger ones are clipped."""

    def reset(self, measurement: Measurement, reference: Trajectory) -> State:
        """Return the initial state: nothing is cut, integrated or carried over."""
        none = np.zeros_like(measurement.position)
        carry = np.zeros((*none.shape[:-1], len(self.thruster_force)))
        return State(none[..., :1].copy(), none, none.copy(), carry)

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Trajectory
    ) -> tuple[State, Command, Signals]:
        """Return the next state, the commands to engine and thrusters, and the signals."""
        at, period = measurement, self.control_period
        error = at.position - reference.position
        angle, slip = turn(at, Reference(*reference[:3]), np.eye(3))
        thrust, force = self._forces(state.integral, error, at, reference)
        torque = self._torque(state.angle_integral, angle, slip, at, reference)

        cut = touched(state.cut, at)
        shares, _ = within(share(np.concatenate([torque, force], axis=-1), self._effects))
        on_time, carry = pulses(shares, state.carry, period, self.thruster_minimum_on)
        straight = np.zeros_like(angle[..., :2])
        burns = self.limited(np.concatenate([thrust, straight], axis=-1))[..., :1]
        command = Command(
            np.where(cut > 0.0, 0.0, burns), straight, np.where(cut > 0.0, 0.0, on_time)
        )
        after = State(
            cut,
            state.integral + period * np.clip(error, -self.integral_reach, self.integral_reach),
            state.angle_integral + period * np.clip(angle, -self.angle_reach, self.angle_reach),
            carry,
        )
        return after, command, Signals(error, angle, thrust, force, torque)

    def _forces(
        self, integral: Array, error: Array, at: Measurement, desired: Trajectory
    ) -> tuple[Array, Array]:
        """Return the engine's thrust [N], (..., 1), and the thrusters' force [N], body axes."""
        rate = at.velocity - desired.velocity
        feedback = self.velocity_gain * rate + self.position_gain * error
        f = desired.linear_acceleration - self.gravity(at.position)
        f = f - shortened(feedback, self.feedback_limit) - self.integral_gain * integral
        force = self.mass_with(at.propellant) * rotate(conjugate(at.attitude), f)
        across = shortened(force * np.array([1.0, 1.0, 0.0]), self.force_limit)
        return force[..., 2:], across

    def _torque(
        self, integral: Array, angle: Array, slip: Array, at: Measurement, desired: Trajectory
    ) -> Array:
        """Return the torque [N m], body axes, (..., 3)."""
        to_body = multiply(conjugate(at.attitude), desired.attitude)
        # The derivative of the desired rate's components in the rotating body axes.
        spin = rotate(to_body, desired.acceleration) - cross(at.rate, at.rate - slip)
        spin = spin - self.rate_gain * slip - self.attitude_gain * angle
        spin = spin - self.attitude_integral_gain * integral
        return times(self.inertia, spin) + cross(at.rate, times(self.inertia, at.rate))

    @cached_property
    def _effects(self) -> Array:
        return effect(self.thruster_positions, self.thruster_directions, self.thruster_force)
