"""Desired descents to a landing site on the Moon, with the attitude that their thrust requires.

World axes: x and y in the landing plane, z up, the origin at the site. (x, y, z) are (Y, Z, X) of
paper 003 (CNCA 2019), less the Moon's radius on X. Body axes are permuted alike: z is along the
thrust.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from mjspace import attitude as att
from mjspace.algebra import times
from mjspace.contract import Array, Trajectory, gain

from .lander_gains import LunarGravity


@dataclass(frozen=True)
class Descent(LunarGravity, ABC):
    """A straight path from ``height`` and ``reach`` to the site, then a hover, then a descent.

    The desired attitude is the paper's: z along the thrust that the motion requires against
    gravity, tilted by gamma_d in the vertical plane of ``azimuth``, and the body's y normal to that
    plane. The desired rate is that of the attitude; the paper sets it to zero.
    """

    duration: float = gain("s", above=0.0)
    """T: duration of the path."""
    height: float = gain("m", default=1000.0, at_least=0.0)
    """Height of the start above the end of the path."""
    reach: float = gain("m", default=2500.0, at_least=0.0)
    """Horizontal distance of the start from the site."""
    azimuth: float = gain("rad", default=0.6435, at_least=-2.0 * np.pi, at_most=2.0 * np.pi)
    """theta_d: direction of the vertical plane, from x towards y."""
    clearance: float = gain("m", default=0.0, at_least=0.0)
    """Height of the end of the path above the site; it raises the start, too. The paper has 0."""
    hover: float = gain("s", default=0.0, at_least=0.0)
    """Duration of the hover at the end of the path."""
    descent_speed: float = gain("m/s", default=0.5, at_least=0.0)
    """Speed of the descent after the hover. It has no end: the law has to detect touchdown."""
    stance: float = gain("m", default=1.8, at_least=0.0)
    """Height of the body origin above the ground when the vehicle stands."""

    @abstractmethod
    def shape(self, s: Array) -> list[Array]:
        """Return the remaining fraction of the path, from 1 to 0, and its first four derivatives
        by ``s`` (n,), the fraction of ``duration`` elapsed."""

    def at(self, time: Array) -> Trajectory:
        """Return the motion at each ``time`` (n,) [s]."""
        start = np.array([np.cos(self.azimuth), np.sin(self.azimuth), 0.0]) * self.reach
        start[2] = self.height
        late = time - self.duration
        left = self.shape(np.clip(time / self.duration, 0.0, 1.0))
        motion = [
            np.where(late <= 0.0, part / self.duration**n, 0.0)[:, None] * start
            for n, part in enumerate(left)
        ]
        down = np.maximum(late - self.hover, 0.0)
        motion[0][:, 2] += self.clearance + self.stance - self.descent_speed * down
        motion[1][down > 0.0, 2] -= self.descent_speed
        return powered(motion, self.azimuth, self.gravity_parameter, self.moon_radius)


@dataclass(frozen=True)
class SineDescent(Descent):
    """1 - sin(pi t / 2T), table 2 of paper 003, which ends with an acceleration of 0.166 m/s^2.

    T is not printed (erratum 18); 200 s fits the time axis of the figures.
    """

    duration: float = gain("s", default=200.0, above=0.0)

    def shape(self, s: Array) -> list[Array]:
        """Return 1 - sin(pi s / 2) and its derivatives."""
        a = 0.5 * np.pi
        sine, cosine = np.sin(a * s), np.cos(a * s)
        return [1.0 - sine, -a * cosine, a**2 * sine, a**3 * cosine, -(a**4) * sine]


@dataclass(frozen=True)
class CubicDescent(Descent):
    """(1 - t/T)^3, not from the paper: starts at the printed velocities, ends unaccelerated."""

    duration: float = gain("s", default=300.0, above=0.0)

    def shape(self, s: Array) -> list[Array]:
        """Return (1 - s)^3 and its derivatives."""
        left = 1.0 - s
        return [left**3, -3.0 * left**2, 6.0 * left, np.full_like(s, -6.0), np.zeros_like(s)]


def powered(
    motion: list[Array], azimuth: float, gravity_parameter: float, moon_radius: float
) -> Trajectory:
    """Return a motion with the attitude, rate and angular acceleration that its thrust requires.

    ``motion`` is the position and its first four derivatives, world axes, each (n, 3) [m/s^k]. The
    attitude is a rotation by ``azimuth`` [rad] about z, then the shortest one from z to the thrust.
    With the thrust in that vertical plane it is psi = theta_d, phi = 0, gamma = gamma_d of paper
    003.
    """
    position, velocity, acceleration = motion[:3]
    thrust = _specific_force(motion, gravity_parameter, moon_radius)
    ahead, aside = np.cos(azimuth), np.sin(azimuth)
    turned = np.array([[ahead, aside, 0.0], [-aside, ahead, 0.0], [0.0, 0.0, 1.0]])
    f, df, ddf = (times(turned, part) for part in thrust)

    size = np.linalg.norm(f, axis=-1)
    dsize = _dot(f, df) / size
    ddsize = (_dot(df, df) + _dot(f, ddf) - dsize**2) / size
    # Q is not of unit length; the rate is 2 (Q* Q')_v / |Q|^2.
    Q, dQ, ddQ = (
        np.stack([along + part[:, 2], -part[:, 1], part[:, 0], 0.0 * along], axis=-1)
        for along, part in ((size, f), (dsize, df), (ddsize, ddf))
    )
    square = _dot(Q, Q)[:, None]
    rate = 2.0 * att.multiply(att.conjugate(Q), dQ)[:, 1:] / square
    growth = 2.0 * _dot(Q, dQ)[:, None] / square
    spin = 2.0 * att.multiply(att.conjugate(Q), ddQ)[:, 1:] / square - growth * rate
    yaw = att.from_rotation_vector(np.array([0.0, 0.0, azimuth]))
    attitude = att.multiply(yaw, att.normalize(Q))
    return Trajectory(attitude, rate, spin, position, velocity, acceleration)


def _specific_force(motion: list[Array], mu: float, radius: float) -> list[Array]:
    """Return thrust over mass [m/s^2] along a motion and its first two derivatives, (n, 3) each.

    The second derivative neglects the change of the gravity gradient, 1e-8 m/s^4 at 30 m/s.
    """
    position, velocity, acceleration, jerk, snap = motion
    p = position + np.array([0.0, 0.0, radius])
    square = _dot(p, p)[:, None]
    pull = mu / (square * np.sqrt(square))
    return [
        acceleration + pull * p,
        jerk + pull * (velocity - 3.0 * _dot(p, velocity)[:, None] / square * p),
        snap + pull * (acceleration - 3.0 * _dot(p, acceleration)[:, None] / square * p),
    ]


def _dot(a: Array, b: Array) -> Array:
    product: Array = np.einsum("ij,ij->i", a, b)
    return product
