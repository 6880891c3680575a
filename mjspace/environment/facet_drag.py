"""Aerodynamic drag on flat facets of the bus in free-molecular flow."""

import math
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from mjspace.contract import Array
from mjspace.environment import joints, kepler
from mjspace.environment.base import Term
from mjspace.environment.bodies import Bodies, add_force_on_bus, in_bus_axes
from mjspace.environment.compiled import compiled
from mjspace.environment.constants import RADIUS
from mjspace.environment.dipole import EARTH_ROTATION
from mjspace.environment.facets import Facet
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import Finite, Positive, Si, Switch

_KM = 1e3
ATMOSPHERE = np.array(
    [
        [150.0, 2.070e-9, 22.523],
        [180.0, 5.464e-10, 29.740],
        [200.0, 2.789e-10, 37.105],
        [250.0, 7.248e-11, 45.546],
        [300.0, 2.418e-11, 53.628],
        [350.0, 9.518e-12, 53.298],
        [400.0, 3.725e-12, 58.515],
        [450.0, 1.585e-12, 60.828],
        [500.0, 6.967e-13, 63.822],
        [600.0, 1.454e-13, 71.835],
        [700.0, 3.614e-14, 88.667],
        [800.0, 1.170e-14, 124.64],
        [900.0, 5.245e-15, 181.05],
        [1000.0, 3.019e-15, 268.00],
    ]
)
"""Base altitude [km], density there [kg/m^3] and scale height [km]: D. A. Vallado, Fundamentals of
Astrodynamics and Applications, 4th edition, 2013, table 8-4. The Sun's activity changes the density
by a factor of up to ten."""

_FACETS = 15  # index of the first facet in the payload
_WIDTH = 7  # numbers of a facet


@compiled
def drag(payload: Any, time: float, bodies: Bodies) -> None:
    """Add the drag on each facet that faces the flow: -1/2 rho C A (n . v) v.

    v is the velocity of the facet relative to the air, n its outward normal, C its drag
    coefficient (Wertz 1978, Spacecraft Attitude Determination and Control, equation 17-57).

    ``payload``: the bus's place in ``qpos``, the orbit's elements (10), the radius [m] at which the
    density [kg/m^3] is the next number, one over the scale height [1/m], the rate [rad/s] at which
    the air turns with the planet about z. Then for each facet half of C A [m^2], n (3) and the
    centre of pressure (3) [m], body axes.
    """
    place, dof = int(payload[0]), bodies.bus_dof
    x, y, z = kepler.position(payload[1:11], time)
    x, y, z = x + bodies.qpos[place], y + bodies.qpos[place + 1], z + bodies.qpos[place + 2]
    altitude = math.sqrt(x * x + y * y + z * z) - payload[11]
    density = payload[12] * math.exp(-altitude * payload[13])
    vx, vy, vz = kepler.velocity(payload[1:11], time)
    vx, vy, vz = vx + bodies.qvel[dof], vy + bodies.qvel[dof + 1], vz + bodies.qvel[dof + 2]
    vx, vy, vz = in_bus_axes(bodies, vx + payload[14] * y, vy - payload[14] * x, vz)
    wx, wy, wz = bodies.qvel[dof + 3], bodies.qvel[dof + 4], bodies.qvel[dof + 5]
    for i in range(_FACETS, payload.size, _WIDTH):
        n, arm = payload[i + 1 : i + 4], payload[i + 4 : i + 7]
        ux = vx + wy * arm[2] - wz * arm[1]
        uy = vy + wz * arm[0] - wx * arm[2]
        uz = vz + wx * arm[1] - wy * arm[0]
        into = n[0] * ux + n[1] * uy + n[2] * uz
        if into > 0.0:
            scale = -density * payload[i] * into
            add_force_on_bus(bodies, arm, (scale * ux, scale * uy, scale * uz))


class FacetDrag(Term):
    """Drag on flat facets of the bus in orbit, in free-molecular flow.

    The air's density is constant or exponential in altitude. By default it is that of a mean Earth
    atmosphere (Vallado 2013, table 8-4), the exponential at the periapsis for all altitudes.
    """

    kernels: ClassVar = {9: drag}
    reads: ClassVar = {"orbit": 1}

    facets: Annotated[list[Facet], Field(min_length=1)] | None = None
    """Each feels the flow on its outward side; those of the environment when left out."""
    density: Annotated[Positive, Si("kg/m^3")] | None = None
    """Constant or, with ``scale_height``, at ``reference_altitude``; the default atmosphere's when
    left out."""
    reference_altitude: Annotated[Finite, Si("m")] | None = None
    """Above a sphere of the planet's equatorial radius. Goes with ``scale_height``."""
    scale_height: Annotated[Positive, Si("m")] | None = None
    """Altitude over which the density falls to 1/e; infinite when left out."""
    corotating: Switch = True
    """Whether the air turns with the Earth; otherwise it does not turn in inertial axes."""

    @model_validator(mode="after")
    def _exponential(self) -> Self:
        if (self.reference_altitude is None) != (self.scale_height is None):
            raise ValueError("reference_altitude and scale_height: give both or neither")
        if self.scale_height is not None and self.density is None:
            raise ValueError("scale_height: needs the density at reference_altitude")
        return self

    def check_environment(self, environment: Environment) -> None:
        """Refuse a vehicle that is not in orbit or where no atmosphere is known."""
        orbit = environment.orbit
        if orbit is None:
            raise ValueError("facet_drag: needs an orbit")
        if (self.facets is None) == (not environment.facets):
            raise ValueError(
                "facet_drag: needs [[environment.facets]], or facets of its own, not both"
            )
        if self.density is not None:
            return
        if orbit.body != "earth":
            raise ValueError(f"facet_drag.density: none is known of the {orbit.body}: give one")
        if (lowest := _lowest_altitude(orbit)) < ATMOSPHERE[0, 0] * _KM:
            raise ValueError(
                f"facet_drag.density: the orbit's lowest altitude, {lowest / _KM:.6g} km, is below "
                f"{ATMOSPHERE[0, 0]:g} km, where the atmosphere's table begins: give a density"
            )

    def payload_size(self, environment: Environment) -> int:
        """Return the size of the parameters of ``drag``."""
        return _FACETS + _WIDTH * len(self.facets or environment.facets)

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return the parameters of ``drag``."""
        orbit: Any = environment.orbit
        altitude, density, scale_height = self._atmosphere(orbit)
        rotation = EARTH_ROTATION if self.corotating and orbit.body == "earth" else 0.0
        _, place = joints.bus(model)
        air = [RADIUS[orbit.body] + altitude, density, 1.0 / scale_height, rotation]
        facets = [
            [0.5 * facet.drag_coefficient * facet.area, *facet.outward, *facet.position]
            for facet in self.facets or environment.facets
        ]
        return np.concatenate([[place], orbit.elements(), air, *facets])

    def _atmosphere(self, orbit: Any) -> tuple[float, float, float]:
        """Return an altitude [m], the density there [kg/m^3] and the scale height [m]."""
        if self.density is not None:
            return self.reference_altitude or 0.0, self.density, self.scale_height or math.inf
        below = np.flatnonzero(ATMOSPHERE[:, 0] * _KM <= _lowest_altitude(orbit))
        altitude, density, scale_height = ATMOSPHERE[below[-1]].tolist()
        return altitude * _KM, density, scale_height * _KM


def _lowest_altitude(orbit: Any) -> float:
    """Return the altitude of the periapsis [m]."""
    lowest: float = orbit.semi_major_axis * (1.0 - orbit.eccentricity) - RADIUS[orbit.body]
    return lowest
