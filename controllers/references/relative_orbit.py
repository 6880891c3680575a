"""Motions near a point of a circular orbit: a fixed place, or the ellipse that costs nothing.

Hill's axes: x is up, from the planet, y ahead along the orbit, z the orbit's normal. W. H. Clohessy
and R. S. Wiltshire, "Terminal guidance system for satellite rendezvous", Journal of the Aerospace
Sciences 27 (1960): x'' - 2 n y' - 3 n^2 x = 0, y'' + 2 n x' = 0, z'' + n^2 z = 0 without thrust.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjspace import attitude as att
from mjspace.contract import Array, Ephemeris, Gains, Trajectory, gain


@dataclass(frozen=True)
class RelativeOrbit(Gains):
    """An ellipse about a centre that rests in Hill's axes, flown with the body's axes along them.

    x = x0 + b sin p, y = y0 + 2 b cos p, z = z0 + c sin(p + cross_phase), with p = n t + phase.
    With x0 and z0 zero it satisfies the Clohessy-Wiltshire equations and needs no thrust: a
    football orbit. With b and c zero a place is held, which takes accelerations of 3 n^2 x0 down
    and n^2 z0 away from the orbit's plane [m/s^2].
    """

    orbit_rate: float = gain("rad/s", default=0.0, at_least=0.0)
    """n: of the orbit in which the frame falls, a circle. Left out, or 0, it is that of the
    scenario's orbit, and so are Hill's axes at time zero."""
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
    """Of Hill's axes at time zero, where ``orbit_rate`` is given: quaternion, scalar first, to
    inertial; normalized. The default is that of an orbit without inclination and with a true
    anomaly of zero."""
    ephemeris: Ephemeris | None = None

    def at(self, time: Array) -> Trajectory:
        """Return the motion at each ``time`` [s], shape (n,).

        Raises:
            ValueError: no rate is given, and the scenario's orbit is no circle.
        """
        (start, n), b, c = self._orbit, self.height, self.across
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
        hill = att.multiply(start, turned)
        return Trajectory(
            hill,
            np.broadcast_to(rate, place.shape),
            np.zeros_like(place),
            *(att.rotate(hill, vector) for vector in (place, velocity, acceleration)),
        )

    @cached_property
    def _orbit(self) -> tuple[Array, float]:
        """Hill's axes at time zero, as a quaternion (4,), and the orbit's rate [rad/s]."""
        if self.orbit_rate > 0.0:
            return att.normalize(self.start_attitude), self.orbit_rate
        if self.ephemeris is None:
            raise ValueError("orbit_rate: missing, without an ephemeris that it could come from")
        place, velocity, acceleration, _ = (row[0] for row in self.ephemeris.origin(np.zeros(1)))
        up, ahead = att.normalize(place), att.normalize(velocity)
        rate = np.linalg.norm(velocity) / np.linalg.norm(place)
        fall = -(rate**2) * place
        off = np.linalg.norm(acceleration - fall) / np.linalg.norm(fall)
        if abs(float(up @ ahead)) > _ROUND or float(off) > _ROUND:
            raise ValueError(
                "orbit_rate: missing, and the scenario's orbit has no constant one: Hill's "
                "equations hold in a circle without j2"
            )
        axes = np.stack([up, ahead, np.cross(up, ahead)], axis=-1)
        return att.from_matrix(axes), float(rate)


_ROUND = 1e-6
"""By how much, of itself, a circle's acceleration may differ from what bends it."""
