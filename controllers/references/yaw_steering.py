"""Yaw steering: nadir pointing that turns about the vertical, so that panels can face the Sun."""

from dataclasses import dataclass

import numpy as np

from mjspace.contract import Array, Ephemeris, gain

from .jets import Jet, cross, dot, unit
from .pointing import Pointing, direction


@dataclass(frozen=True)
class YawSteering(Pointing):
    """z to the planet's centre, and the Sun in the half plane of z and positive x.

    Panels that turn about y can then face the Sun (Bar-Sever 1996, "A new model for GPS yaw
    attitude", Journal of Geodesy 70). The yaw is atan2(tan b, sin m) from the orbit's axes, b the
    Sun's elevation above the orbit's plane and m the angle along the orbit from the point nearest
    the Sun or farthest from it. Near those points it turns at up to m'/tan b. It is kept below
    ``rate_limit`` by sqrt(tan^2 b + f t^2) in place of tan b, t = m'/rate_limit: f is
    1/(1 + sin^2 m / (3 t^2))^2, so that the Sun leaves the plane there alone. That is ours; known
    laws of this kind, as that of Galileo's or BeiDou's satellites, change b likewise within a
    threshold.

    The way round is that of the Sun's side of the orbit's plane at time zero: in a flight in which
    the Sun crosses the plane it ends on the other side of the x-z plane's half.
    """

    ephemeris: Ephemeris
    rate_limit: float = gain("rad/s", above=0.0)
    """Of the yaw, relative to the orbit's axes; 2 % faster at an eccentricity of 0.4, where those
    turn unevenly."""

    def directions(self, time: Array) -> tuple[Jet, Jet]:
        """Return the nadir, and where x is to be."""
        nadir = direction(self.ephemeris, "nadir", time)
        momentum = direction(self.ephemeris, "orbit normal", time)
        sun = unit(direction(self.ephemeris, "sun", time))
        normal = unit(momentum)
        up = unit(nadir).times(-1.0)
        ahead = cross(normal, up)
        along, side, radial = dot(sun, ahead), dot(sun, normal), dot(sun, up)
        level = along * along + radial * radial  # cos^2 b
        turning = dot(momentum, normal) * dot(nadir, nadir).power(-1.0)  # m', without radial part
        most = (turning * turning).times(self.rate_limit**-2)  # t^2
        narrow = (most * level).times(3.0)
        part = narrow * (narrow + along * along).power(-1.0)  # sqrt(f)
        widened = side * side + part * part * most * level
        return nadir, ahead * along + normal * widened.power(0.5).times(self._side)

    @property
    def axes(self) -> tuple[Array, Array]:
        """Return z and x."""
        return np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])

    @property
    def _side(self) -> float:
        """1 where the Sun is on the side of the orbit's normal at time zero, else -1."""
        start = np.zeros(1)
        normal = direction(self.ephemeris, "orbit normal", start)
        sun = direction(self.ephemeris, "sun", start)
        return float(np.copysign(1.0, dot(sun, normal).value[0, 0]))
