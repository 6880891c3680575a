"""How much of the Sun a planet's shadow leaves visible: cones of umbra and penumbra, or a cylinder.

The planet is a sphere without an atmosphere.
"""

import math
from typing import Any

import numpy as np

from mjspace.environment.compiled import compiled


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


@compiled
def visible_at(places: Any, suns: Any, planet: float, disc: float) -> Any:
    """Return ``visible`` for each row of ``places`` and of the Sun's positions ``suns``, (n, 3).

    Both are from the planet's centre.
    """
    found = np.empty(len(places))
    for i in range(len(places)):
        x, y, z = places[i]
        sx, sy, sz = suns[i]
        found[i] = visible(x, y, z, sx - x, sy - y, sz - z, planet, disc)
    return found
