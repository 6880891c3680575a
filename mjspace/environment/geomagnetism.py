"""The Earth's magnetic field where an orbit leads, as cubics of time that a native callback reads.

The field is that at the frame's origin: a vehicle a kilometre off feels another by 4e-4 of it.
"""

import math
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from pyIGRF14.calculate import igrf12syn as synthesis  # of the 14th generation, by its data
from pyIGRF14.loadCoeffs import get_coeffs

from mjspace.contract import Array
from mjspace.environment import cubics, dipole
from mjspace.environment.earth_rotation import EARTH_ROTATION, sidereal_angle
from mjspace.environment.magnetic_field import MagneticField
from mjspace.environment.orbit import orbit_position
from mjspace.scenario.environment import Environment

SPACING = 10.0
"""s at most between the field's samples, which are whole control periods apart."""


@dataclass(frozen=True)
class Dipole:
    """The Earth's dipole: the terms of degree 1 of the reference field."""

    strength: float
    """The field on the magnetic equator times the radius cubed [T m^3]."""
    tilt: float
    """Of the northern pole from the Earth's axis [rad]."""
    longitude: float
    """Of the northern pole, east of Greenwich [rad]."""


def dipole_of(epoch: datetime) -> Dipole:
    """Return the dipole at ``epoch``, UTC, by IGRF-14 (IAGA 2024, doi:10.5281/zenodo.14012302).

    The coefficients of every fifth year are interpolated; reference radius 6371.2 km.
    """
    g, h = get_coeffs(_year(epoch))
    axial, prime, east = (1e-9 * value for value in (g[1][0], g[1][1], h[1][1]))  # T
    return Dipole(
        strength=math.hypot(axial, prime, east) * 6371.2e3**3,
        tilt=math.atan2(math.hypot(prime, east), -axial),
        longitude=math.atan2(-east, -prime),
    )


def along(environment: Environment, control: float, duration: float) -> cubics.Cubics:
    """Return the field [T], inertial axes, along the environment's orbit for ``duration`` [s].

    A spline of samples: with one every 10 s of an orbit of 97 minutes over the poles it is within
    7e-14 T of the dipole's field and 2e-13 T of the reference field, 4e-9 of it; measured.
    ``control`` is the control period [s].

    Raises:
        ValueError: the orbit meets the planet.
    """
    table, orbit = environment.magnetic_field, environment.orbit
    epoch = table.time_zero(environment)
    return cubics.through(
        lambda time: field_at(table, epoch, orbit_position(orbit, time), time),
        duration,
        control,
        SPACING,
    )


def field_at(table: MagneticField, epoch: datetime, place: Array, time: Array) -> Array:
    """Return the field [T] at each ``place`` [m] from the centre and ``time`` [s], (n, 3) and (n,).

    Places and field are in inertial axes. Dipole and reference field are those of the epoch, and do
    not age from it on: in a day they change by 1e-5 of themselves.
    """
    turned = sidereal_angle(epoch)
    if table.model == "dipole":
        earth = dipole_of(epoch)
        tilt = earth.tilt if table.tilt is None else table.tilt
        longitude = earth.longitude + turned
        rotation = EARTH_ROTATION
        poles = [dipole.northern_pole(t, tilt, longitude, rotation) for t in time]
        rows = [dipole.dipole(*both, earth.strength) for both in zip(place, poles, strict=True)]
        return np.array(rows)
    radius = np.sqrt(np.sum(place**2, axis=-1))
    latitude = np.arcsin(place[:, 2] / radius)
    ascension = np.arctan2(place[:, 1], place[:, 0])
    longitudes = np.degrees(ascension - turned - EARTH_ROTATION * time) % 360.0
    year = _year(epoch)
    where = zip(1e-3 * radius, np.degrees(latitude), longitudes, strict=True)
    # itype 2: geocentric; km, degrees, nT
    north, east, down, _ = np.array([synthesis(year, 2, *point) for point in where]).T
    level = -np.sin(latitude) * north - np.cos(latitude) * down
    along_axis = np.cos(latitude) * north - np.sin(latitude) * down
    cosine, sine = np.cos(ascension), np.sin(ascension)
    x, y = level * cosine - east * sine, level * sine + east * cosine
    return 1e-9 * np.column_stack([x, y, along_axis])


def _year(epoch: datetime) -> float:
    """Return the epoch in years."""
    start = datetime(epoch.year, 1, 1)
    return epoch.year + (epoch - start) / (datetime(epoch.year + 1, 1, 1) - start)
