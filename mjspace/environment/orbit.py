"""The orbit whose free-fall frame the vehicle flies in: what is left of gravity there.

It is given by its elements, by a position and velocity, or by a satellite's two-line elements.
"""

import math
from datetime import datetime, timedelta
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, field_validator, model_validator

from mjspace.contract import Array
from mjspace.environment import kepler, oblate_orbit, two_line_elements
from mjspace.environment.base import Term
from mjspace.environment.constants import GM, J2, RADIUS
from mjspace.environment.osculating import elements_of
from mjspace.environment.tides import tidal
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import (
    Epoch,
    Finite,
    Meters3,
    Positive,
    Si,
    Switch,
    Velocity3,
    WithinTurn,
)

_FRESH = 14.0
"""Days from their epoch for which two-line elements are taken for those of the satellite."""
_NOT_GIVEN: Any = None  # a number for all who read it of an orbit that has elements
_ELEMENTS = (
    "semi_major_axis",
    "eccentricity",
    "inclination",
    "ascending_node",
    "periapsis",
    "true_anomaly",
)


class Orbit(Term):
    """The orbit: its gravity gradient acts on every body, in the free-fall frame.

    Elements, ``position`` and ``velocity``, or a ``tle``: one of the three.
    """

    kernels: ClassVar = {1: tidal}
    reads: ClassVar = {"orbit": 0}

    body: Literal["earth", "moon"] = "earth"
    """What is orbited."""
    semi_major_axis: Annotated[Positive, Si("m")] = _NOT_GIVEN
    """From the body's centre."""
    eccentricity: Annotated[Finite, Field(ge=0, lt=1)] = 0.0
    """0 is a circle."""
    inclination: Annotated[Finite, Field(ge=0, le=math.pi), Si("rad")] = 0.0
    """To the inertial x-y plane; above 90 deg the orbit is retrograde."""
    ascending_node: WithinTurn = 0.0
    """Right ascension of the ascending node."""
    periapsis: WithinTurn = 0.0
    """Argument of periapsis."""
    true_anomaly: WithinTurn = 0.0
    """At time zero."""

    position: Meters3 | None = None
    """At time zero, from the body's centre, inertial axes."""
    velocity: Velocity3 | None = None
    """At time zero, inertial axes; below that of escape."""

    tle: list[str] | None = None
    """The two lines of a satellite of the Earth; SGP4 says where it is at each control instant, and
    its orbit holds for a control period."""
    tle_file: str | None = None
    """A file that has them, beside the scenario: two lines for each satellite, with a line before
    them for its name or without. It is read with the scenario, whose log has the lines alone."""
    satellite: str | int | None = None
    """Which of a ``tle_file``: its name or its catalogue number. Left out where there is one."""
    epoch: Epoch | None = None
    """Of an orbit from a ``tle``: time zero, UTC, where ``environment.epoch`` is left out; that of
    the two lines without either."""

    j2: Switch = False
    """Whether the Earth's oblateness acts on the orbit. Elements are then mean ones: node,
    periapsis and mean anomaly drift at their secular rates. A position and velocity are osculating:
    the motion from them is integrated, periodic terms included. Either way an orbit holds for a
    control period."""

    @field_validator("eccentricity", mode="before")
    @classmethod
    def _closed(cls, eccentricity: Any) -> Any:
        if type(eccentricity) in (int, float) and eccentricity >= 1:
            raise ValueError(
                f"got {eccentricity:g}, should be less than 1: a parabola or hyperbola, which "
                "escapes, is no orbit that there is here"
            )
        return eccentricity

    @field_validator("tle")
    @classmethod
    def _two_lines(cls, tle: list[str] | None) -> list[str] | None:
        if tle is not None:
            two_line_elements.refuse_malformed(tle)
        return tle

    @model_validator(mode="after")
    def _file_is_read(self) -> Self:
        if self.tle_file is not None:
            if self.tle:
                raise ValueError("tle_file: got tle too: leave one of them out")
            raise ValueError("tle_file: is read with a scenario's file: give its lines, tle")
        if self.satellite is not None:
            raise ValueError("satellite: is one of a tle_file")
        return self

    @model_validator(mode="after")
    def _given_once(self) -> Self:
        changed = [n for n in _ELEMENTS if getattr(self, n) != type(self).model_fields[n].default]
        by_state = [n for n in ("position", "velocity") if getattr(self, n) is not None]
        ways = [*changed[:1], *by_state[:1], *(["tle"] if self.tle else [])]
        if len(ways) > 1:
            raise ValueError(
                f"got {' and '.join(ways)}: an orbit has elements, a position and velocity, or a "
                "tle: give one of the three"
            )
        if not by_state and not self.tle and self.semi_major_axis is None:
            raise ValueError(
                "semi_major_axis: missing; or give a position and velocity, or a tle, instead"
            )
        if len(by_state) == 1:
            raise ValueError(
                f"{'velocity' if by_state == ['position'] else 'position'}: missing beside "
                f"{by_state[0]}"
            )
        if self.position is not None and not any(self.position):
            raise ValueError("position: got the centre of the body")
        if self.tle and self.body != "earth":
            raise ValueError('tle: is of a satellite of body = "earth"')
        if self.epoch is not None and not self.tle:
            raise ValueError("epoch: is of an orbit from a tle: set environment.epoch")
        return self

    @model_validator(mode="after")
    def _of_the_earth(self) -> Self:
        if self.j2 and self.body not in J2:
            raise ValueError(f'j2: is that of body = "earth", not of the {self.body}')
        if self.j2 and self.tle:
            raise ValueError("j2: SGP4 has it already: leave it out")
        return self

    @model_validator(mode="after")
    def _above_the_planet(self) -> Self:
        try:
            elements = self.elements()
        except ValueError as error:
            raise ValueError(f"{'tle' if self.tle else 'velocity'}: {error}") from None
        semi_major_axis = float(np.sqrt(np.sum(elements[4:7] ** 2)))
        lowest, radius = semi_major_axis * (1.0 - float(elements[3])), RADIUS[self.body]
        if lowest <= radius:
            key = next(k for k in ("semi_major_axis", "position", "tle") if getattr(self, k))
            size = self.semi_major_axis or float(np.sqrt(np.sum(np.square(self.position or 0.0))))
            shown = f"'{size:.10g} km'" if key == "semi_major_axis" else "km"
            meant = f": did you mean {shown}?" if radius < 1e3 * size < 100.0 * radius else ""
            got = f"got {size:.10g} m, with which " if size else ""
            raise ValueError(
                f"{key}: {got}the periapsis, "
                f"{lowest:.6g} m from the centre, is inside the {self.body}, whose radius is "
                f"{radius:.6g} m{meant}"
            )
        return self

    @property
    def drifts_on(self) -> bool:
        """Whether another Kepler orbit holds in each control period."""
        return self.j2 or self.tle is not None

    @property
    def time_zero(self) -> datetime | None:
        """Time zero, UTC, where the orbit says it."""
        return self.epoch or (two_line_elements.epoch_of(self.tle) if self.tle else None)

    @property
    def stale(self) -> str:
        """A warning of two-line elements that are long before or after time zero, else empty."""
        if not self.tle or self.epoch is None:
            return ""
        of = two_line_elements.epoch_of(self.tle)
        days = abs(self.epoch - of) / timedelta(days=1)
        if days <= _FRESH:
            return ""
        return (
            f"the elements are of {of:%Y-%m-%d}, {days:.0f} days from time zero, "
            f"{self.epoch:%Y-%m-%d}: SGP4 may be off by a kilometre or more for each day"
        )

    def begun_at(self, epoch: datetime | None) -> Self:
        """Return the orbit with time zero at ``epoch``, UTC, if it depends on that.

        Raises:
            ValueError: the orbit has another epoch of its own.
        """
        if not self.tle or epoch is None:
            return self
        if self.epoch not in (None, epoch):
            raise ValueError(
                f"epoch: {self.epoch} differs from environment.epoch, {epoch}: leave it out"
            )
        return self.model_copy(update={"epoch": epoch})

    def payload_size(self, environment: Environment) -> int:
        """Return the size of ``elements``."""
        return 10

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return ``elements``."""
        return self.elements()

    def elements(self) -> Array:
        """Return what ``kepler.position`` and ``kepler.velocity`` read at time zero, ten numbers.

        GM [m^3/s^2], mean motion [rad/s], mean anomaly at time zero [rad], eccentricity, then the
        two semi-axes as vectors [m], towards the periapsis and along the motion there.
        """
        gm = GM[self.body]
        if self.semi_major_axis is None:
            return self._osculating(np.zeros(1))[0]
        a, e = self.semi_major_axis, self.eccentricity
        half = math.atan2(
            math.sqrt(1.0 - e) * math.sin(0.5 * self.true_anomaly),
            math.sqrt(1.0 + e) * math.cos(0.5 * self.true_anomaly),
        )
        mean_anomaly = 2.0 * half - e * math.sin(2.0 * half)
        # columns: towards the ascending node and 90 deg ahead of it in the orbit
        node, tilt = self.ascending_node, self.inclination
        ahead = [-math.sin(node) * math.cos(tilt), math.cos(node) * math.cos(tilt), math.sin(tilt)]
        plane = np.column_stack([[math.cos(node), math.sin(node), 0.0], ahead])
        cosine, sine = math.cos(self.periapsis), math.sin(self.periapsis)
        major = a * plane @ [cosine, sine]
        minor = a * math.sqrt(1.0 - e * e) * plane @ [-sine, cosine]
        return np.array([gm, math.sqrt(gm / a**3), mean_anomaly, e, *major, *minor])

    def drifts(self) -> tuple[float, float, float]:
        """Return the secular rates of node, periapsis and mean anomaly, less the Kepler orbit's.

        [rad/s]; to first order in J2 (Vallado 2013, Fundamentals of Astrodynamics and Applications,
        4th edition, section 9.6.1). Zero without ``j2``.
        """
        if not self.j2 or self.semi_major_axis is None:
            return 0.0, 0.0, 0.0
        a, shrink = self.semi_major_axis, 1.0 - self.eccentricity**2
        rate = math.sqrt(GM[self.body] / a**3)
        scale = 0.75 * rate * J2[self.body] * (RADIUS[self.body] / (a * shrink)) ** 2
        sine2 = math.sin(self.inclination) ** 2
        return (
            -2.0 * scale * math.cos(self.inclination),
            scale * (4.0 - 5.0 * sine2),
            scale * math.sqrt(shrink) * (2.0 - 3.0 * sine2),
        )

    def rows(self, time: Array) -> Array:
        """Return the elements that hold at each ``time`` [s], (...), as (..., 10).

        Where they drift, GM is the pull that makes the orbit turn as it does (mean elements), or
        that at the place, with the Earth's oblateness (a ``tle``, a position and velocity). With GM
        alone, 1e-3 off, the tides would not fit the motion, and what is beside the origin would
        leave it, 2,500 times as far after a day at 500 km.

        Raises:
            ValueError: SGP4 does not know the satellite then.
        """
        if self.drifts_on and self.semi_major_axis is None:
            return self._osculating(np.ravel(time)).reshape(*time.shape, 10)
        elements = self.elements()
        if not self.j2:
            return np.broadcast_to(elements, (*time.shape, 10))
        node, periapsis, anomaly = self.drifts()
        turning = elements[1] + anomaly + periapsis + node * math.cos(self.inclination)
        elements[0] *= (turning / elements[1]) ** 2
        elements[1] += anomaly
        major, minor = elements[4:7], elements[7:]
        shrink = math.sqrt(1.0 - self.eccentricity**2)
        cosine, sine = np.cos(periapsis * time)[..., None], np.sin(periapsis * time)[..., None]
        axes = (
            cosine * major + sine / shrink * minor,
            cosine * minor - shrink * sine * major,
        )
        cosine, sine = np.cos(node * time)[..., None], np.sin(node * time)[..., None]
        parts = [np.broadcast_to(elements[:4], (*time.shape, 4))]
        for axis in axes:  # about the Earth's axis
            x, y, z = (axis[..., k : k + 1] for k in range(3))
            parts += [cosine * x - sine * y, sine * x + cosine * y, z]
        return np.concatenate(parts, axis=-1)

    def _osculating(self, time: Array) -> Array:
        """Return the elements at each ``time`` [s], (n,), from positions and velocities."""
        if self.tle:
            epoch = self.time_zero
            assert epoch is not None
            place, velocity = two_line_elements.motion(self.tle, epoch, time)
        else:
            place, velocity = (np.array([v], dtype=float) for v in (self.position, self.velocity))
            if not self.j2:
                return elements_of(place, velocity, time, GM[self.body])
            place, velocity = oblate_orbit.motion(place[0], velocity[0], time)
        elements = elements_of(place, velocity, time, GM[self.body])
        elements[:, 0] *= oblate_orbit.pull(place)
        return elements


def orbit_position(orbit: Orbit, time: ArrayLike) -> Array:
    """Return the position of the frame's origin from the planet's centre, inertial axes [m].

    ``time`` [s] of shape (...) gives positions of shape (..., 3).
    """
    return _along(orbit, time)[0]


def orbit_velocity(orbit: Orbit, time: ArrayLike) -> Array:
    """Return the velocity of the frame's origin, inertial axes [m/s], likewise."""
    return _along(orbit, time)[1]


def _along(orbit: Orbit, time: Any) -> tuple[Array, Array]:
    times = time if hasattr(time, "shape") else np.asarray(time, dtype=np.float64)
    found: tuple[Array, Array] = kepler.along.ufunc(orbit.rows(times), times, np.zeros(3))
    return found
