"""Aerodynamic drag on flat facets of the bus in free-molecular flow."""

import math
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import model_validator

from mjspace.contract import Array
from mjspace.environment import cubics, joints, kepler
from mjspace.environment.base import Term
from mjspace.environment.bodies import Bodies, add_wrench_on_bus, in_bus_axes
from mjspace.environment.compiled import compiled
from mjspace.environment.constants import RADIUS
from mjspace.environment.earth_rotation import EARTH_ROTATION
from mjspace.environment.facets import Facet
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import Finite, NonNegative, Positive, Si, Switch, Table

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

_FACETS = 15  # index of the first facet in the payload of drag
_AIR = 11  # index of the density's cubic in the other's
_FACETS_ALONG = _AIR + cubics.SIZE + 1
_WIDTH = 7  # numbers of a facet


@compiled
def drag(payload: Any, time: float, bodies: Bodies) -> None:
    """Add the drag in air whose density is exponential in altitude.

    ``payload``: the bus's place in ``qpos``, the orbit's elements (10), the radius [m] at which the
    density [kg/m^3] is the next number, one over the scale height [1/m], the rate [rad/s] at which
    the air turns with the planet about z, then the facets as ``add_drag`` has them.
    """
    (x, y, z), speed = motion_of(payload, time, bodies)
    altitude = math.sqrt(x * x + y * y + z * z) - payload[11]
    density = payload[12] * math.exp(-altitude * payload[13])
    turning = payload[14]
    flow = speed[0] + turning * y, speed[1] - turning * x, speed[2]
    add_drag(payload, bodies, density, flow, _FACETS)


@compiled
def drag_along(payload: Any, time: float, bodies: Bodies) -> None:
    """Add the drag in air whose density is known along the orbit.

    ``payload``: the bus's place in ``qpos``, the orbit's elements (10), a cubic of time as
    ``nrlmsis.along`` makes it, the rate [rad/s] at which the air turns with the planet about z,
    then the facets as ``add_drag`` has them.
    """
    (x, y, z), speed = motion_of(payload, time, bodies)
    air, since = payload[_AIR:_FACETS_ALONG], time - payload[_AIR]
    higher = math.sqrt(x * x + y * y + z * z) - cubics.component(air, 1, since)
    falling = cubics.component(air, 2, since)
    density = math.exp(cubics.component(air, 0, since) - higher * falling)
    turning = air[cubics.SIZE]
    flow = speed[0] + turning * y, speed[1] - turning * x, speed[2]
    add_drag(payload, bodies, density, flow, _FACETS_ALONG)


@compiled
def motion_of(payload: Any, time: float, bodies: Bodies) -> tuple[Any, Any]:
    """Return the bus's place [m] from the planet's centre and velocity [m/s], inertial axes."""
    place, dof = int(payload[0]), bodies.bus_dof
    x, y, z, vx, vy, vz = kepler.motion(payload[1:11], time)
    at = x + bodies.qpos[place], y + bodies.qpos[place + 1], z + bodies.qpos[place + 2]
    return at, (vx + bodies.qvel[dof], vy + bodies.qvel[dof + 1], vz + bodies.qvel[dof + 2])


@compiled
def add_drag(payload: Any, bodies: Bodies, density: float, flow: Any, first: int) -> None:
    """Add the drag on each facet that faces the flow: -1/2 rho C A (n . v) v.

    v is the velocity of the facet relative to the air, n its outward normal, C its drag
    coefficient (Wertz 1978, Spacecraft Attitude Determination and Control, equation 17-57). For
    each facet the ``payload`` has, from ``first`` on, half of C A [m^2], n (3) and the centre of
    pressure (3) [m], body axes; ``flow`` is the bus's velocity relative to the air, inertial axes
    [m/s].
    """
    dof = bodies.bus_dof + 3
    vx, vy, vz = in_bus_axes(bodies, flow[0], flow[1], flow[2])
    wx, wy, wz = bodies.qvel[dof], bodies.qvel[dof + 1], bodies.qvel[dof + 2]
    fx = fy = fz = tx = ty = tz = 0.0
    for i in range(first, payload.size, _WIDTH):
        ax, ay, az = payload[i + 4], payload[i + 5], payload[i + 6]
        ux, uy, uz = vx + wy * az - wz * ay, vy + wz * ax - wx * az, vz + wx * ay - wy * ax
        into = payload[i + 1] * ux + payload[i + 2] * uy + payload[i + 3] * uz
        if into > 0.0:
            scale = -density * payload[i] * into
            px, py, pz = scale * ux, scale * uy, scale * uz
            fx, fy, fz = fx + px, fy + py, fz + pz
            tx += ay * pz - az * py
            ty += az * px - ax * pz
            tz += ax * py - ay * px
    add_wrench_on_bus(bodies, (fx, fy, fz), (tx, ty, tz))


class Nrlmsis(Table):
    """NRLMSIS 2.1: the density at the epoch's date, place and local time, for a given Sun."""

    f107: Positive
    """Solar flux at 10.7 cm of the day before, in 1e-22 W/(m^2 Hz): 70 to 250."""
    f107a: Positive | None = None
    """Its mean over 81 days; ``f107`` when left out."""
    ap: NonNegative = 4.0
    """Daily geomagnetic index: 4 is quiet, 100 a storm."""

    @property
    def mean_f107(self) -> float:
        """The mean of the flux."""
        return self.f107 if self.f107a is None else self.f107a


class FacetDrag(Term):
    """Drag on flat facets of the bus in orbit, in free-molecular flow.

    The air's density is constant, exponential in altitude, or that of ``nrlmsis``. By default it is
    that of a mean Earth atmosphere (Vallado 2013, table 8-4), the exponential at the periapsis for
    all altitudes.
    """

    kernels: ClassVar = {9: drag, 13: drag_along}

    facets: list[Facet] = []
    """Each feels the flow on its outward side; those of the environment when left out."""
    density: Annotated[Positive, Si("kg/m^3")] | None = None
    """Constant or, with ``scale_height``, at ``reference_altitude``; the default atmosphere's when
    left out."""
    reference_altitude: Annotated[Finite, Si("m")] | None = None
    """Above a sphere of the planet's equatorial radius. Goes with ``scale_height``."""
    scale_height: Annotated[Positive, Si("m")] | None = None
    """Altitude over which the density falls to 1/e; infinite when left out."""
    nrlmsis: Nrlmsis | None = None
    """The density of NRLMSIS 2.1 along the orbit instead of these."""
    corotating: Switch = True
    """Whether the air turns with the Earth; otherwise it does not turn in inertial axes."""

    @model_validator(mode="after")
    def _exponential(self) -> Self:
        if (self.reference_altitude is None) != (self.scale_height is None):
            raise ValueError("reference_altitude and scale_height: give both or neither")
        if self.scale_height is not None and self.density is None:
            raise ValueError("scale_height: needs the density at reference_altitude")
        if self.nrlmsis is not None and self.density is not None:
            raise ValueError("density and nrlmsis: give one of them")
        return self

    @property
    def reads(self) -> dict[str, int]:  # type: ignore[override]
        """What is written into its parameters in flight."""
        return {"orbit": 1} | ({} if self.nrlmsis is None else {"air_density": _AIR})

    def block_kind(self) -> int:
        """Return which kernel knows the density."""
        return 9 if self.nrlmsis is None else 13

    def check_environment(self, environment: Environment) -> None:
        """Refuse a vehicle that is not in orbit or where no atmosphere is known."""
        orbit = environment.orbit
        if orbit is None:
            raise ValueError("facet_drag: needs an orbit")
        if bool(self.facets) == bool(environment.facets):
            raise ValueError(
                "facet_drag: needs [[environment.facets]], or facets of its own, not both"
            )
        if self.nrlmsis is not None and not environment.has_sun:
            raise ValueError(
                'facet_drag.nrlmsis: needs environment.epoch and an orbit with body = "earth"'
            )
        if self.density is not None or self.nrlmsis is not None:
            return
        if orbit.body != "earth":
            raise ValueError(f"facet_drag.density: none is known of the {orbit.body}: give one")
        if (lowest := _lowest_altitude(orbit)) < ATMOSPHERE[0, 0] * _KM:
            raise ValueError(
                f"facet_drag.density: the orbit's lowest altitude, {lowest / _KM:.6g} km, is below "
                f"{ATMOSPHERE[0, 0]:g} km, where the atmosphere's table begins: give a density"
            )

    def payload_size(self, environment: Environment) -> int:
        """Return the size of the kernel's parameters."""
        first = _FACETS if self.nrlmsis is None else _FACETS_ALONG
        return first + _WIDTH * len(self.facets or environment.facets)

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return the kernel's parameters; a cubic is written as the vehicle flies."""
        orbit: Any = environment.orbit
        rotation = EARTH_ROTATION if self.corotating and orbit.body == "earth" else 0.0
        _, place = joints.bus(model)
        if self.nrlmsis is not None:
            air = [0.0] * cubics.SIZE
        else:
            altitude, density, scale_height = self._atmosphere(orbit)
            air = [RADIUS[orbit.body] + altitude, density, 1.0 / scale_height]
        facets = [
            [0.5 * facet.drag_coefficient * facet.area, *facet.outward, *facet.position]
            for facet in self.facets or environment.facets
        ]
        return np.concatenate([[place], orbit.elements(), air, [rotation], *facets])

    def _atmosphere(self, orbit: Any) -> tuple[float, float, float]:
        """Return an altitude [m], the density there [kg/m^3] and the scale height [m]."""
        if self.density is not None:
            return self.reference_altitude or 0.0, self.density, self.scale_height or math.inf
        below = np.flatnonzero(ATMOSPHERE[:, 0] * _KM <= _lowest_altitude(orbit))
        altitude, density, scale_height = ATMOSPHERE[below[-1]].tolist()
        return altitude * _KM, density, scale_height * _KM


def _lowest_altitude(orbit: Any) -> float:
    """Return the altitude of the periapsis [m]."""
    elements = orbit.elements()
    semi_major_axis = math.hypot(*elements[4:7])
    return float(semi_major_axis * (1.0 - elements[3])) - RADIUS[orbit.body]
