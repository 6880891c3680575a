"""A planar arm on a satellite: its joints follow smooth paths, the wheels take its reaction.

While the bus rests, Lagrange's equations of the angles phi of bus and links in the plane, about the
centre of mass of all, are Q_i = sum_j h_ij (cos(phi_i - phi_j) phi_j'' + sin(phi_i - phi_j)
phi_j'^2), with the masses in h; E. Papadopoulos, S. Dubowsky, "On the nature of control algorithms
for free-floating space manipulators", IEEE Transactions on Robotics and Automation 7 (1991) have
the general ones. A joint's torque is the sum of Q from its link to the tip, and the sum of all is
the torque that keeps the bus at rest. All arrays may have leading vehicle axes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from mjspace.attitude import conjugate, multiply, to_rotation_vector
from mjspace.contract import Array, Gains, Measurement, Reference, Unit, gain


class Command(NamedTuple):
    """To the wheels and to the joints' motors."""

    torque: Annotated[Array, Unit("N m")]
    """On the bus, body axes, (..., 3)."""
    joint_torque: Annotated[Array, Unit("N m")]
    """Of each joint, from the shoulder on, (..., n)."""


class State(NamedTuple):
    """Memory of this law: empty."""


class Signals(NamedTuple):
    """Signals of this law."""

    joint_error: Annotated[Array, Unit("rad")]
    """Measured less desired angle of each joint, (..., n)."""
    reaction: Annotated[Array, Unit("N m")]
    """Torque about z that keeps the bus at rest while the arm follows its path, (..., 1)."""


@dataclass(frozen=True)
class PlanarArm(Gains):
    """Moves all joints from rest to rest at once; the wheels hold the bus where it is desired.

    The joints' axes are the body's z; the arm extends along x from a shoulder on the x axis.
    """

    batched: ClassVar[bool] = True

    control_period: float = gain("s", above=0.0)
    """Time from one step to the next."""
    link_length: Array = gain("m", ("joint",), above=0.0)
    """Of each link; the vehicle's where left out, as the next two."""
    link_mass: Array = gain("kg", ("joint",), above=0.0)
    link_inertia: Array = gain("kg m^2", ("joint",), above=0.0)
    """About the link's centre of mass, across it."""
    mass: float = gain("kg", above=0.0)
    """Of all but the arm."""
    shoulder: float = gain("m", at_least=0.0)
    """From the centre of mass of all but the arm to the first joint, along x."""
    start: Array = gain("rad", ("joint",))
    """Angles where the path begins."""
    target: Array = gain("rad", ("joint",))
    """Angles where it ends."""
    duration: float = gain("s", above=0.0)
    """From rest to rest, along a quintic."""
    joint_gain: float = gain("N m/rad", above=0.0)
    """Torque of each joint's motor for its angle's error, beside that which its path needs."""
    joint_rate_gain: float = gain("N m s/rad", above=0.0)
    """And for its rate's error."""
    attitude_gain: float = gain("N m/rad", above=0.0)
    """Torque on the bus for its attitude error, the same on each axis."""
    rate_gain: float = gain("N m s/rad", above=0.0)
    """And for its rate."""
    start_time: float = gain("s", default=0.0)
    """When the path begins."""
    feedforward: float = gain(default=1.0, at_least=0.0, at_most=1.0)
    """Share of the arm's reaction that the wheels take without waiting for an error."""

    def reset(self, measurement: Measurement, reference: Reference) -> State:
        """Return the empty state."""
        return State()

    def step(
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, Command, Signals]:
        """Return the torques on the bus and of the joints."""
        angle, rate, _ = self.path(time)
        off = measurement.gimbal_angle - angle
        feedback = -self.joint_gain * off
        feedback -= self.joint_rate_gain * (measurement.gimbal_rate - rate)
        # Held over the period: what is right in its middle.
        needed = self.torques(*self.path(time + 0.5 * self.control_period))
        reaction = np.sum(needed, keepdims=True) + 0.0 * measurement.rate[..., :1]
        turned = to_rotation_vector(multiply(conjugate(reference.attitude), measurement.attitude))
        torque = -self.attitude_gain * turned - self.rate_gain * measurement.rate
        torque += self.feedforward * reaction * np.array([0.0, 0.0, 1.0])
        command = Command(torque, feedback + needed @ self._sums)
        return state, command, Signals(off, reaction)

    def path(self, time: float) -> tuple[Array, Array, Array]:
        """Return the joints' desired angles [rad], rates and accelerations at ``time``, (n,)."""
        s = np.clip((time - self.start_time) / self.duration, 0.0, 1.0)
        left, whole = 1.0 - s, self.target - self.start
        way = s * s * s * (10.0 - s * (15.0 - 6.0 * s))
        rate = 30.0 * s * s * left * left / self.duration
        acceleration = 60.0 * s * left * (left - s) / self.duration**2
        return self.start + way * whole, rate * whole, acceleration * whole

    def torques(self, angle: Array, rate: Array, acceleration: Array) -> Array:
        """Return Q of the bus and of each link [N m], (n + 1,), with the bus at rest.

        The arguments are of the joints, (n,): angles [rad] and their derivatives.
        """
        phi, turning, faster = (self._sums @ each for each in (angle, rate, acceleration))
        apart = phi[:, None] - phi
        forces = np.cos(apart) * faster + np.sin(apart) * turning * turning
        needed: Array = np.sum(self._metric * forces, axis=-1)
        return needed

    @cached_property
    def _sums(self) -> Array:
        """The bus's angle and the links', from the joints', (n + 1, n)."""
        return np.tri(len(self.link_mass) + 1, len(self.link_mass), -1)

    @cached_property
    def _metric(self) -> Array:
        """h [kg m^2], (n + 1, n + 1): of the bus, then of the links."""
        count = len(self.link_mass)
        arms = np.array([self.shoulder, *self.link_length])
        reach = np.tri(count + 1, count + 1, -1) * arms
        reach[np.arange(1, count + 1), np.arange(1, count + 1)] = 0.5 * self.link_length
        masses = np.array([self.mass, *self.link_mass])
        about_centre = reach - masses @ reach / masses.sum()
        own = np.diag([0.0, *self.link_inertia])
        metric: Array = about_centre.T @ (masses[:, None] * about_centre) + own
        return metric
