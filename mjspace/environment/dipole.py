"""The magnetic field of a planet, a dipole at its centre, compiled for native callbacks."""

import math
from typing import Any

from mjspace.environment.compiled import compiled


@compiled
def dipole(place: Any, north: Any, strength: float) -> tuple[float, float, float]:
    """Return the field [T] at ``place`` [m] from the planet's centre.

    ``north`` is the unit vector to the northern magnetic pole, where the field points down, and
    ``strength`` [T m^3] the field on the magnetic equator times the radius cubed; all in the same
    axes. Wertz 1978, Spacecraft Attitude Determination and Control, appendix H.
    """
    x, y, z = place[0], place[1], place[2]
    radius2 = x * x + y * y + z * z
    scale = strength / (radius2 * math.sqrt(radius2))
    up = 3.0 * (north[0] * x + north[1] * y + north[2] * z) / radius2
    return scale * (north[0] - up * x), scale * (north[1] - up * y), scale * (north[2] - up * z)


@compiled
def northern_pole(
    time: float, tilt: float, longitude: float, rotation: float
) -> tuple[float, float, float]:
    """Return the unit vector to the northern magnetic pole, inertial axes, at ``time`` [s].

    It is ``tilt`` [rad] off the z axis, about which the planet turns at ``rotation`` [rad/s];
    ``longitude`` [rad], from the x axis, is the pole's at time zero.
    """
    turned = longitude + rotation * time
    return math.sin(tilt) * math.cos(turned), math.sin(tilt) * math.sin(turned), math.cos(tilt)
