"""Where the Moon is, in the inertial axes of a flight around the Earth: those of ``sun``."""

from datetime import datetime

import erfa
import numpy as np

from mjspace.contract import Array
from mjspace.environment import cubics
from mjspace.environment.constants import ASTRONOMICAL_UNIT
from mjspace.environment.sun import dynamical_time

SPACING = 7200.0
"""s at most between samples."""


def position(epoch: datetime, time: Array) -> Array:
    """Return the Moon's position from the Earth's centre [m], inertial axes, (n, 3).

    ``time`` [s], (n,), is counted from ``epoch``, UTC. Geometric. ERFA's ``moon98``: Meeus 1998,
    Astronomical Algorithms, 2nd edition, chapter 47, within 8 arc seconds and 6 km by its rms.
    """
    day, begin = dynamical_time(epoch)
    places = erfa.moon98(day, begin + time / 86400.0)
    axes = erfa.pmat06(day, begin)
    place: Array = ASTRONOMICAL_UNIT * np.asarray(places["p"]) @ axes.T
    return place


def along(epoch: datetime, control: float, duration: float) -> cubics.Cubics:
    """Return the Moon's position [m] for ``duration`` [s], a sample at least every two hours.

    Within 4e-7 deg of ``position`` in a flight of a day, and of a month; measured.
    """
    return cubics.through(lambda time: position(epoch, time), duration, control, SPACING)
