"""What is left of a planet's gravity in a frame that falls along an orbit, compiled."""

import math
from typing import Any

from mjspace.environment import kepler
from mjspace.environment.bodies import Bodies, add_wrench
from mjspace.environment.compiled import compiled
from mjspace.environment.gravity import gradient_torque


@compiled
def tidal(orbit: Any, time: float, bodies: Bodies) -> None:
    """Add the planet's gravity less that at the frame's origin, which falls along ``orbit``.

    Every body feels it at its own centre of mass, and 3 GM/r^3 u x I u, the gravity-gradient torque
    of its own inertia there, u the unit vector from the planet (Wertz 1978, Spacecraft Attitude
    Determination and Control, section 17.2.1). The difference is Encke's, without cancellation
    (Battin 1999, Mathematics and Methods of Astrodynamics, chapter 8).
    """
    rx, ry, rz = kepler.position(orbit, time)
    radius2 = rx * rx + ry * ry + rz * rz
    rate2 = orbit[0] / (radius2 * math.sqrt(radius2))
    for body in range(1, bodies.body_mass.size):
        mass = bodies.body_mass[body]
        if mass == 0.0:
            continue
        dx, dy, dz = bodies.xipos[body]
        x, y, z = rx + dx, ry + dy, rz + dz
        # |R + d|^2 = (1 + q) |R|^2;  shrink = (1 + q)^(-3/2) - 1
        q = (dx * (dx + 2.0 * rx) + dy * (dy + 2.0 * ry) + dz * (dz + 2.0 * rz)) / radius2
        ratio3 = (1.0 + q) * math.sqrt(1.0 + q)
        shrink = -q * (3.0 + q * (3.0 + q)) / (ratio3 * (1.0 + ratio3))
        scale = -mass * rate2
        force = (scale * (dx + shrink * x), scale * (dy + shrink * y), scale * (dz + shrink * z))
        factor = 3.0 * rate2 / (ratio3 * (1.0 + q) * radius2)
        add_wrench(bodies, body, force, gradient_torque(bodies, body, x, y, z, factor))
