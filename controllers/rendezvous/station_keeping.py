"""Station keeping near a point of an orbit, on thrusters, in position and attitude.

All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from mjspace.algebra import dot, times
from mjspace.attitude import conjugate, rotate
from mjspace.contract import Array, Measurement, PulseCommand, Reference, Trajectory, Unit, gain

from ..attitude.turn import turn
from ..thrusters.pulsed_pd import PulsedPd


class State(NamedTuple):
    """Memory of the law."""

    carry: Annotated[Array, Unit("s")]
    """On-time of each thruster that is carried over [s], (..., n)."""
    delta_v: Annotated[Array, Unit("m/s")]
    """Commanded so far: net impulse of each period over the mass, summed up [m/s], (..., 1)."""


class Signals(NamedTuple):
    """Signals of the law."""

    position_error: Annotated[Array, Unit("m")]
    """Measured less desired position, the reference's axes [m], (..., 3)."""
    angle: Annotated[Array, Unit("rad")]
    """Rotation vector from the desired to the measured attitude [rad], body axes, (..., 3)."""
    force: Annotated[Array, Unit("N")]
    """Commanded, body axes [N], (..., 3)."""
    delta_v: Annotated[Array, Unit("m/s")]
    """Commanded so far [m/s], (..., 1)."""


@dataclass(frozen=True, kw_only=True)
class StationKeeping(PulsedPd):
    """F = m (a_d - g - w^2 e - 2 z w e'), with the torque of ``PulsedPd``, by thrusters.

    g = n^2 (3 (u . r) u - r) is what is left of gravity at r in the free-fall frame of a circular
    orbit, to first order in r (Clohessy and Wiltshire 1960). The up direction u is the desired x
    axis and n the desired rate, as ``relative_orbit:RelativeOrbit`` has them.
    """

    mass: float = gain("kg", above=0.0)
    """m: of the whole vehicle."""
    bandwidth: float = gain("rad/s", default=0.02, above=0.0)
    """w."""
    damping_ratio: float = gain(default=0.8, above=0.0)
    """z."""

    def reset(self, measurement: Measurement, reference: Trajectory) -> State:  # type: ignore[override]
        """Return the initial state: nothing is carried over."""
        none = np.zeros((*measurement.rate.shape[:-1], len(self.thruster_force)))
        return State(none, none[..., :1].copy())

    def step(  # type: ignore[override]
        self, state: State, time: float, measurement: Measurement, reference: Trajectory
    ) -> tuple[State, PulseCommand, Signals]:
        """Return the next state, the on-times of this period, and the signals."""
        turning = Reference(reference.attitude, reference.rate, reference.acceleration)
        angle, slip = turn(measurement, turning, np.eye(3))
        torque = self._torque(angle, slip, measurement.rate, turning)
        error = measurement.position - reference.position
        force = rotate(conjugate(measurement.attitude), self._force(measurement, error, reference))
        _, on_time, carry = self._pulses(state.carry, torque, force)
        pushes = self.thruster_force * self.thruster_directions.T
        impulse = times(pushes, on_time)
        delta_v = state.delta_v + np.sqrt(dot(impulse, impulse)) / self.mass
        own = rotate(conjugate(reference.attitude), error)
        signals = Signals(own, angle, force, delta_v.copy())
        return State(carry, delta_v), PulseCommand(on_time), signals

    def _force(self, measurement: Measurement, error: Array, reference: Trajectory) -> Array:
        """Return the force [N], inertial axes, (..., 3)."""
        position, w = measurement.position, self.bandwidth
        up = rotate(reference.attitude, np.array([1.0, 0.0, 0.0])) + 0.0 * position
        rate2 = dot(reference.rate, reference.rate)
        natural = rate2 * (3.0 * dot(up, position) * up - position)
        slip = measurement.velocity - reference.velocity
        wanted = reference.linear_acceleration - natural
        force: Array = self.mass * (wanted - w**2 * error - 2.0 * self.damping_ratio * w * slip)
        return force
