"""How much of the Sun a planet's shadow leaves visible: cones of umbra and penumbra, or a cylinder.

The planet is a sphere without an atmosphere.
"""

import math
from typing import Any

from mjspace.contract import Array
from mjspace.environment.compiled import compiled
from mjspace.gufunc import gufunc


@compiled
def visible(
    x: float, y: float, z: float, sx: float, sy: float, sz: float, planet: float, disc: float
) -> float:
    """Return the visible part of the Sun's disc, 0 to 1.

    (x, y, z) is the place from the planet's centre, (sx, sy, sz) the Sun from that place, all [m]
    in the same axes; ``planet`` and ``disc`` are the radii of planet and Sun [m]. With ``disc``
    zero the shadow is the cylinder behind the planet. The overlap of two discs on the sky:
    Montenbruck and Gill 2000, Satellite Orbits, section 3.4.2.
    """
    ahead = x * sx + y * sy + z * sz
    if ahead >= 0.0:
        return 1.0
    radius2, distance2 = x * x + y * y + z * z, sx * sx + sy * sy + sz * sz
    if disc == 0.0:
        return 0.0 if radius2 - ahead * ahead / distance2 < planet * planet else 1.0
    radius, distance = math.sqrt(radius2), math.sqrt(distance2)
    a, b = math.asin(disc / distance), math.asin(min(1.0, planet / radius))
    c = math.acos(-ahead / (radius * distance))
    if c >= a + b:
        return 1.0
    if c <= abs(b - a):
        return max(0.0, 1.0 - (b / a) ** 2)
    along = 0.5 * (c * c + a * a - b * b) / c
    across = math.sqrt(max(0.0, a * a - along * along))
    overlap = a * a * math.atan2(across, along) + b * b * math.atan2(across, c - along) - c * across
    return 1.0 - overlap / (math.pi * a * a)


def visible_from(place: Array, sun: Array, planet: float, disc: float) -> Array:
    """Return ``visible`` at each ``place`` with the ``sun`` there, (..., 3), as (..., 1).

    Both are from the planet's centre.
    """
    part: Array = _visible_from.ufunc(place, sun, planet, disc)
    return part[..., None]


@gufunc(["void(f8[:], f8[:], f8, f8, f8[:])"], "(v),(v),(),()->()")
def _visible_from(place: Any, sun: Any, planet: Any, disc: Any, part: Any) -> None:
    x, y, z = place[0], place[1], place[2]
    part[0] = visible(x, y, z, sun[0] - x, sun[1] - y, sun[2] - z, planet, disc)
