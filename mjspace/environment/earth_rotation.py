"""How the Earth turns under a flight, and where above it a place is."""

import math
from datetime import datetime, timedelta

import erfa
import numpy as np

from mjspace.contract import Array

EARTH_ROTATION = 7.292115e-5  # rad/s; Moritz 2000, Geodetic Reference System 1980
_WGS84 = 1  # erfa's number of the ellipsoid


def sidereal_angle(epoch: datetime) -> float:
    """Return Greenwich mean sidereal time [rad] at ``epoch``, UTC, which is within 1 s of UT1.

    IERS Conventions (2010), Technical Note 36, (5.14) and (5.32) to the second order.
    """
    days = (epoch - datetime(2000, 1, 1, 12)) / timedelta(days=1)
    turns = 0.7790572732640 + 0.00273781191135448 * days + days % 1.0
    centuries = days / 36525.0
    precession = 0.014506 + (4612.156534 + 1.3915817 * centuries) * centuries
    return math.fmod(2.0 * math.pi * turns + math.radians(precession / 3600.0), 2.0 * math.pi)


def geodetic(epoch: datetime, place: Array, time: Array) -> tuple[Array, Array, Array]:
    """Return east longitude [rad], geodetic latitude [rad] and height [m] on WGS 84, each (...).

    ``place`` [m], (..., 3), is from the Earth's centre in inertial axes at ``time`` [s], (...),
    from ``epoch``, UTC. ERFA's ``gc2gd``: Fukushima 2006, J. Geodesy 79, 689.
    """
    angle = sidereal_angle(epoch) + EARTH_ROTATION * time
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y, z = place[..., 0], place[..., 1], place[..., 2]
    fixed = np.stack([cosine * x + sine * y, cosine * y - sine * x, z], axis=-1)
    longitude, latitude, height = erfa.gc2gd(_WGS84, fixed)
    return longitude, latitude, height
