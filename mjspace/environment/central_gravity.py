"""A planet's gravity in the frame of a landing site: origin on its sphere, z up."""

import numpy as np

from mjspace.constants import GM, RADIUS
from mjspace.contract import Array
from mjspace.scenario.landing import CentralGravity


def pack(gravity: CentralGravity) -> Array:
    """Return the gravitational parameter [m^3/s^2] and the distance to the centre [m], (2,)."""
    gm = GM[gravity.body] if gravity.gm is None else gravity.gm
    radius = RADIUS[gravity.body] if gravity.radius is None else gravity.radius
    return np.array([gm, radius])


def acceleration(packed: Array, position: Array) -> Array:
    """Return the acceleration [m/s^2] at ``position`` [m], both (..., 3) in the site's frame."""
    from_centre = position + packed[1] * np.array([0.0, 0.0, 1.0])
    distance = np.sqrt(np.sum(from_centre**2, axis=-1, keepdims=True))
    result: Array = -packed[0] / distance**3 * from_centre
    return result
