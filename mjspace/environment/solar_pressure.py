"""The pressure of sunlight on flat facets of the bus, less what the Earth's shadow takes."""

import math
from typing import Annotated, Any, ClassVar

import numpy as np

from mjspace.contract import Array
from mjspace.environment import cubics, joints, kepler, shadow
from mjspace.environment.base import Term
from mjspace.environment.bodies import Bodies, add_wrench_on_bus, in_bus_axes
from mjspace.environment.compiled import compiled
from mjspace.environment.constants import ASTRONOMICAL_UNIT, RADIUS, SUN_RADIUS
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import Positive, Si

_SUN = 11  # index of the Sun's cubic in the payload
_FACETS = _SUN + cubics.SIZE + 3
_WIDTH = 9  # numbers of a facet


@compiled
def press(payload: Any, time: float, bodies: Bodies) -> None:
    """Add the pressure on each facet that the Sun shines on.

    -p A (n . s) ((1 - specular) s + 2 (specular n . s + diffuse / 3) n), s the unit vector to the
    Sun and n the outward normal (Markley and Crassidis 2014, Fundamentals of Spacecraft Attitude
    Determination and Control, equation 3.167), p inverse to the square of the Sun's distance.

    ``payload``: the bus's place in ``qpos``, the orbit's elements (10), the cubic of the Sun's
    position [m], the radii of planet and Sun as ``shadow.visible`` has them [m], the pressure times
    the square of the distance [N]. Then for each facet A (1 - specular), 2 A specular and
    2/3 A diffuse [m^2], n (3) and the centre of pressure (3) [m], body axes.
    """
    place = int(payload[0])
    x, y, z = kepler.position(payload[1:11], time)
    x, y, z = x + bodies.qpos[place], y + bodies.qpos[place + 1], z + bodies.qpos[place + 2]
    sun, since = payload[_SUN:_FACETS], time - payload[_SUN]
    sx = cubics.component(sun, 0, since) - x
    sy = cubics.component(sun, 1, since) - y
    sz = cubics.component(sun, 2, since) - z
    light = shadow.visible(x, y, z, sx, sy, sz, sun[cubics.SIZE], sun[cubics.SIZE + 1])
    if light == 0.0:
        return
    distance2 = sx * sx + sy * sy + sz * sz
    pressure = light * sun[cubics.SIZE + 2] / distance2
    unit = 1.0 / math.sqrt(distance2)
    sx, sy, sz = in_bus_axes(bodies, unit * sx, unit * sy, unit * sz)
    fx = fy = fz = tx = ty = tz = 0.0
    for i in range(_FACETS, payload.size, _WIDTH):
        nx, ny, nz = payload[i + 3], payload[i + 4], payload[i + 5]
        cosine = nx * sx + ny * sy + nz * sz
        if cosine > 0.0:
            scale = -pressure * cosine
            ray = scale * payload[i]
            normal = scale * (payload[i + 1] * cosine + payload[i + 2])
            px, py, pz = ray * sx + normal * nx, ray * sy + normal * ny, ray * sz + normal * nz
            ax, ay, az = payload[i + 6], payload[i + 7], payload[i + 8]
            fx, fy, fz = fx + px, fy + py, fz + pz
            tx += ay * pz - az * py
            ty += az * px - ax * pz
            tz += ax * py - ay * px
    add_wrench_on_bus(bodies, (fx, fy, fz), (tx, ty, tz))


class SolarPressure(Term):
    """The pressure of sunlight on the facets of the environment, in an orbit around the Earth.

    What is absorbed is not radiated again. The Earth's shadow is that of ``environment.shadow``.
    """

    kernels: ClassVar = {11: press}
    reads: ClassVar = {"orbit": 1, "sun_position": _SUN}

    pressure: Annotated[Positive, Si("N/m^2")] = 4.56e-6
    """On a surface that absorbs all, at 1 au."""

    def check_environment(self, environment: Environment) -> None:
        """Refuse an environment without facets or in which the Sun's place is not known."""
        if not environment.facets:
            raise ValueError("solar_pressure: needs [[environment.facets]]")
        if not environment.has_sun:
            raise ValueError('solar_pressure: needs an epoch and an orbit with body = "earth"')

    def payload_size(self, environment: Environment) -> int:
        """Return the size of the parameters of ``press``."""
        return _FACETS + _WIDTH * len(environment.facets)

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return the parameters of ``press``; the Sun's cubic is written as the vehicle flies."""
        orbit: Any = environment.orbit
        _, place = joints.bus(model)
        light = [*shadow_radii(environment), self.pressure * ASTRONOMICAL_UNIT**2]
        facets = [
            [
                facet.area * (1.0 - facet.specular),
                2.0 * facet.area * facet.specular,
                2.0 / 3.0 * facet.area * facet.diffuse,
                *facet.outward,
                *facet.position,
            ]
            for facet in environment.facets
        ]
        sun = np.zeros(cubics.SIZE)
        return np.concatenate([[place], orbit.elements(), sun, light, *facets])


def shadow_radii(environment: Environment) -> tuple[float, float]:
    """Return the radii of the Earth and the Sun [m] that ``shadow.visible`` is told."""
    return RADIUS["earth"], SUN_RADIUS if environment.shadow == "cones" else 0.0
