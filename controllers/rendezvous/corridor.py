"""Approach to a docking port along its axis, on thrusters, from relative navigation.

The closing speed falls in proportion to the distance that is left (a glideslope: W. Fehse,
"Automated Rendezvous and Docking of Spacecraft", Cambridge 2003, section 3.3), down to the speed of
contact; across the axis and in attitude the law is a second-order loop about the port's axes. All
arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace import attitude as att
from mjspace.algebra import times
from mjspace.contract import Array, Gains, Measurement, PulseCommand, Reference, Unit, gain

from ..thrusters.allocation import effect, pulses, share, within


class State(NamedTuple):
    """Memory of the law."""

    carry: Annotated[Array, Unit("s")]
    """On-time of each thruster that is carried over [s], (..., n)."""


class Signals(NamedTuple):
    """Signals of the law."""

    distance: Annotated[Array, Unit("m")]
    """Left along the docking axis, as measured [m], (..., 1)."""
    off_axis: Annotated[Array, Unit("rad")]
    """Angle of the own port off the docking axis, seen from the apex of the corridor, (..., 1)."""
    closing_speed: Annotated[Array, Unit("m/s")]
    """Desired [m/s], (..., 1)."""
    force: Annotated[Array, Unit("N")]
    """Commanded, body axes [N], (..., 3)."""
    torque: Annotated[Array, Unit("N m")]
    """Commanded, body axes [N m], (..., 3)."""


@dataclass(frozen=True)
class CorridorApproach(Gains):
    """F = m a and tau = H alpha + w x H w, by thrusters, from where the two ports are.

    It needs ``relative_position``, ``relative_attitude``, ``relative_velocity`` and
    ``relative_rate``: of the own port in the axes of the other, which is at the origin. The own
    port's axes are the body's. Once the ports are within reach of the latch nothing is fired.
    """

    batched: ClassVar[bool] = True

    mass: float = gain("kg", above=0.0)
    """m: of the whole vehicle."""
    inertia: Array = gain("kg m^2", (3, 3), form="inertia")
    """H: of the whole vehicle, about its centre of mass, body axes."""
    port: Array = gain("m", (3,))
    """Of the own port, from the centre of mass, body axes."""
    thruster_positions: Array = gain("m", ("thruster", 3))
    """From the centre of mass, body axes, (n, 3)."""
    thruster_directions: Array = gain(shape=("thruster", 3), form="unit vector")
    """Of the force on the vehicle, body axes, (n, 3)."""
    thruster_force: Array = gain("N", ("thruster",), above=0.0)
    """Of each, (n,)."""
    control_period: float = gain("s", above=0.0)
    thruster_minimum_on: float = gain("s", default=0.0, at_least=0.0)
    """Shorter pulses are not fired but carried over."""
    slope: float = gain("1/s", default=0.02, above=0.0)
    """Closing speed over the distance that is left."""
    fastest: float = gain("m/s", default=0.2, above=0.0)
    """Closing speed at most."""
    contact_speed: float = gain("m/s", default=0.02, above=0.0)
    """Closing speed at least, with which the ports meet."""
    reach: float = gain("m", default=0.05, at_least=0.0)
    """Of the latch: nearer than that it fires nothing."""
    corridor_apex: float = gain("m", default=0.5, above=0.0)
    """How far behind the other port the corridor's cone has its apex."""
    bandwidth: float = gain("rad/s", default=0.1, above=0.0)
    """Of the loop across the axis; the speed along it follows with the same."""
    attitude_bandwidth: float = gain("rad/s", default=0.3, above=0.0)
    """Of the attitude loop."""
    damping_ratio: float = gain(default=0.8, above=0.0)
    """Of both loops."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the initial state: nothing is carried over."""
        return State(np.zeros((*measurement.rate.shape[:-1], len(self.thruster_force))))

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, PulseCommand, Signals]:
        """Return the next state, the on-times of this period, and the signals."""
        q = measurement.relative_attitude
        to_body = att.conjugate(q)
        arm = att.rotate(q, np.broadcast_to(self.port, measurement.rate.shape))
        position = measurement.relative_position
        # Of the centre of mass, which the force accelerates: the port turns about it.
        velocity = measurement.relative_velocity - np.cross(measurement.relative_rate, arm)
        acceleration, closing = self._acceleration(position, velocity)
        force = self.mass * att.rotate(to_body, acceleration)
        torque = self._torque(q, att.rotate(to_body, measurement.relative_rate), measurement.rate)

        near = np.sqrt(np.sum(position**2, axis=-1, keepdims=True)) < self.reach
        desired = np.where(near, 0.0, np.concatenate([torque, force], axis=-1))
        shares, _ = within(share(desired, self._effects))
        on_time, carry = pulses(shares, state.carry, self.control_period, self.thruster_minimum_on)
        across = np.sqrt(np.sum(position[..., 1:] ** 2, axis=-1, keepdims=True))
        behind = np.maximum(self.corridor_apex - position[..., :1], 0.0)
        signals = Signals(
            distance=-position[..., :1],
            off_axis=np.arctan2(across, behind),
            closing_speed=closing,
            force=desired[..., 3:],
            torque=desired[..., :3],
        )
        return State(carry), PulseCommand(on_time), signals

    def _acceleration(self, position: Array, velocity: Array) -> tuple[Array, Array]:
        """Return the desired acceleration [m/s^2] and closing speed [m/s], the port's axes."""
        left = -position[..., :1]
        closing = np.clip(self.slope * left, self.contact_speed, self.fastest)
        w, damping = self.bandwidth, 2.0 * self.damping_ratio * self.bandwidth
        along = damping * (closing - velocity[..., :1])
        across = -(w**2) * position[..., 1:] - damping * velocity[..., 1:]
        return np.concatenate([along, across], axis=-1), closing

    def _torque(self, q: Array, slip: Array, rate: Array) -> Array:
        """Return the torque [N m] that aligns the axes of the ports, body axes."""
        w = self.attitude_bandwidth
        turn = att.to_rotation_vector(q)
        acceleration = -(w**2) * turn - 2.0 * self.damping_ratio * w * slip
        torque: Array = times(self.inertia, acceleration) + np.cross(
            rate, times(self.inertia, rate)
        )
        return torque

    @cached_property
    def _effects(self) -> Array:
        return effect(self.thruster_positions, self.thruster_directions, self.thruster_force)
