"""The air's density along an orbit by NRLMSIS 2.1, as cubics of time that a native callback reads.

At the frame's origin it is the model's; about it, exponential in altitude with the model's scale
height there.
"""

from datetime import datetime
from typing import Any

import erfa
import numpy as np
import pymsis

from mjspace.contract import Array
from mjspace.environment import cubics
from mjspace.environment.earth_rotation import EARTH_ROTATION, sidereal_angle
from mjspace.environment.orbit import orbit_position
from mjspace.scenario.environment import Environment

SPACING = 20.0
"""s at most between samples, in which a low orbit passes over 150 km."""
_APART = 1e3  # m, up and down, for the scale height
_WGS84 = 1


def density_at(epoch: datetime, indices: Any, place: Array, time: Array) -> tuple[Array, Array]:
    """Return the density [kg/m^3] and one over the scale height [1/m], each (n,).

    At each ``place`` [m] from the Earth's centre, inertial axes, (n, 3), and ``time`` [s] from
    ``epoch``, UTC, on. J. T. Emmert et al. 2022, NRLMSIS 2.1, JGR Space Physics 127, by the package
    pymsis, at geodetic places of WGS84; ``indices`` is a ``facet_drag.Nrlmsis``.
    """
    turned = sidereal_angle(epoch) + EARTH_ROTATION * time
    cosine, sine = np.cos(turned), np.sin(turned)
    x, y = place[:, 0] * cosine + place[:, 1] * sine, place[:, 1] * cosine - place[:, 0] * sine
    longitude, latitude, height = erfa.gc2gd(_WGS84, np.column_stack([x, y, place[:, 2]]))
    dates = np.datetime64(epoch) + (1e3 * time).astype("timedelta64[ms]")
    n = len(time)
    sun = {"f107s": np.full(n, indices.f107), "f107as": np.full(n, indices.mean_f107)}
    sun["aps"] = np.full((n, 7), indices.ap)
    level, above, below = (
        pymsis.calculate(dates, np.degrees(longitude), np.degrees(latitude), height_km, **sun)
        for height_km in (1e-3 * (height + step) for step in (0.0, _APART, -_APART))
    )
    density = [rows[:, pymsis.Variable.MASS_DENSITY].astype(float) for rows in (above, below)]
    falling: Array = np.log(density[1] / density[0]) / (2.0 * _APART)
    here: Array = level[:, pymsis.Variable.MASS_DENSITY].astype(float)
    return here, falling


def along(environment: Environment, control: float, duration: float) -> cubics.Cubics:
    """Return cubics of the density along the orbit for ``duration`` [s].

    Their vectors: the logarithm of the density [kg/m^3] at the frame's origin, its distance from
    the Earth's centre [m], and one over the scale height [1/m]. ``control`` is the control period
    [s]. Within 5e-5 of ``density_at``, whose single precision that is, at 250 to 820 km; measured.
    10 km above or below the frame's origin it is 2 % off.
    """
    orbit, epoch = environment.orbit, environment.time_zero
    assert epoch is not None

    def values(time: Array) -> Array:
        places = orbit_position(orbit, time)
        density, falling = density_at(epoch, environment.facet_drag.nrlmsis, places, time)
        return np.column_stack([np.log(density), np.linalg.norm(places, axis=1), falling])

    return cubics.through(values, duration, control, SPACING)
