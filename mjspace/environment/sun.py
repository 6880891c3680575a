"""Where the Sun is, in the inertial axes of a flight around the Earth.

The axes are the mean equator and equinox of the epoch, to which the magnetic field's sidereal time
refers too. Those of J2000 differ from them by precession, 0.014 deg a year.
"""

from datetime import datetime, timedelta

import erfa
import numpy as np

from mjspace.contract import Array
from mjspace.environment import cubics
from mjspace.environment.constants import ASTRONOMICAL_UNIT

SPACING = 86400.0
"""s at most between samples: the Moon moves the Earth by 4700 km every 27 days."""
_J2000 = 2451545.0  # Julian date
_TT_BEHIND_UTC = 69.184 / 86400.0  # days since 2017; the Sun moves by 8e-4 deg in that time


def dynamical_time(epoch: datetime) -> tuple[float, float]:
    """Return ``epoch``, UTC, as a Julian date of terrestrial time in two parts [days]."""
    return _J2000, (epoch - datetime(2000, 1, 1, 12)) / timedelta(days=1) + _TT_BEHIND_UTC


def position(epoch: datetime, time: Array) -> Array:
    """Return the Sun's position from the Earth's centre [m], inertial axes, (n, 3).

    ``time`` [s], (n,), is counted from ``epoch``, UTC. Geometric, without the 0.0057 deg of
    aberration. ERFA's ``epv00``: X. Moisson and P. Bretagnon's VSOP2000 as fitted to DE405, for the
    years 1900 to 2100; precession is that of IAU 2006 (``pmat06``).
    """
    day, begin = dynamical_time(epoch)
    heliocentric, _ = erfa.epv00(day, begin + time / 86400.0)
    axes = erfa.pmat06(day, begin)
    place: Array = -ASTRONOMICAL_UNIT * np.asarray(heliocentric["p"]) @ axes.T
    return place


def along(epoch: datetime, control: float, duration: float) -> cubics.Cubics:
    """Return the Sun's position [m] for ``duration`` [s], a sample at least every day.

    Within 1e-6 deg of ``position`` in a flight of a day, and of a year; measured.
    """
    return cubics.through(lambda time: position(epoch, time), duration, control, SPACING)
