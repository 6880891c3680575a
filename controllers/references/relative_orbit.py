"""Motions near a point of a circular orbit: a fixed place, or the ellipse that costs nothing.

Hill's axes: x is up, from the planet, y ahead along the orbit, z the orbit's normal. W. H. Clohessy
and R. S. Wiltshire, "Terminal guidance system for satellite rendezvous", Journal of the Aerospace
Sciences 27 (1960): x'' - 2 n y' - 3 n^2 x = 0, y'' + 2 n x' = 0, z'' + n^2 z = 0 without thrust.
"""

from dataclasses import dataclass

import numpy as np

from mjspace import attitude as att
from mjspace.contract import Array, Gains, Trajectory, gain


@dataclass(frozen=True)
class RelativeOrbit(Gains):
    """An ellipse about a centre that rests in Hill's axes, flown with the body's axes along them.

    x = x0 + b sin p, y = y0 + 2 b cos p, z = z0 + c sin(p + cross_phase), with p = n t + phase.
    With x0 and z0 zero it satisfies the Clohessy-Wiltshire equations and needs no thrust: a
    football orbit. With b and c zero a place is held, which takes accelerations of 3 n^2 x0 down
    and n^2 z0 away from the orbit's plane [m/s^2].
    """

    orbit_rate: float = gain("rad/s", above=0.0)
    """n: of the orbit in which the frame falls, a circle."""
    center: Array = gain("m", (3,), default=(0.0, 0.0, 0.0))
    """(x0, y0, z0), Hill's axes."""
    height: float = gain("m", default=0.0, at_least=0.0)
    """b: the semi-axis along x, half of that along y."""
    phase: float = gain("rad", default=0.0)
    """p at time zero."""
    across: float = gain("m", default=0.0, at_least=0.0)
    """c."""
    cross_phase: float = gain("rad", default=0.0)
    start_attitude: Array = gain(shape=(4,), default=(1.0, 0.0, 0.0, 0.0), form="quaternion")
    """Of Hill's axes at time zero: quaternion, scalar first, to inertial; normalized. The default
    is that of an orbit without inclination and with a true anomaly of zero."""

    def at(self, time: Array) -> Trajectory:
        """Return the motion at each ``time`` [s], shape (n,)."""
        n, b, c = self.orbit_rate, self.height, self.across
        rate = np.array([0.0, 0.0, n])
        p = n * time + self.phase
        q = p + self.cross_phase
        place = self.center + np.stack([b * np.sin(p), 2.0 * b * np.cos(p), c * np.sin(q)], axis=-1)
        moves = n * np.stack([b * np.cos(p), -2.0 * b * np.sin(p), c * np.cos(q)], axis=-1)
        bends = -n * n * (place - self.center)
        spun = np.cross(rate, place)
        velocity = moves + spun
        acceleration = bends + 2.0 * np.cross(rate, moves) + np.cross(rate, spun)
        turned = att.from_rotation_vector(time[:, None] * rate)
        hill = att.multiply(att.normalize(self.start_attitude), turned)
        return Trajectory(
            hill,
            np.broadcast_to(rate, place.shape),
            np.zeros_like(place),
            *(att.rotate(hill, vector) for vector in (place, velocity, acceleration)),
        )
