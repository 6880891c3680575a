"""Two-line elements (TLE), the catalogued mean elements of a satellite, and where SGP4 takes it.

The theory is that of the package sgp4: Hoots and Roehrich, Spacetrack Report No. 3, 1980, as
corrected by Vallado, Crawford, Hujsak and Kelso, Revisiting Spacetrack Report #3, AIAA 2006-6753.
Its axes are TEME: the true equator and the mean equinox of date.
"""

import functools
from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Any

import numpy as np
from sgp4.api import SGP4_ERRORS, WGS72, Satrec
from sgp4.conveniences import sat_epoch_datetime
from sgp4.earth_gravity import wgs72
from sgp4.io import compute_checksum, twoline2rv

from mjspace.contract import Array
from mjspace.errors import shortened

_LENGTH = 69
_KM = 1e3
_BEFORE = datetime(1858, 11, 17)
_JULIAN = 2400000.5  # date of that day


def refuse_malformed(lines: Sequence[str]) -> None:
    """Refuse what are not the two lines of a satellite.

    Raises:
        ValueError: with the line, what was found and what would be right.
    """
    if len(lines) != 2:
        raise ValueError(
            f"should be two lines, which begin with 1 and 2; got {len(lines)}: leave out the name"
        )
    for number, line in enumerate(lines, start=1):
        if not line.startswith(f"{number} "):
            raise ValueError(f"line {number} is {shortened(line)!r}, should begin with '{number} '")
        if len(line) != _LENGTH:
            raise ValueError(f"line {number} has {len(line)} characters, should have {_LENGTH}")
        right = compute_checksum(line)
        if line[-1] != str(right):
            raise ValueError(
                f"line {number} ends with the checksum {line[-1]!r}, should be {right}: a digit "
                "before it, or the checksum itself, was copied wrongly"
            )
    if lines[0][2:7] != lines[1][2:7]:
        names = " and ".join(repr(line[2:7]) for line in lines)
        raise ValueError(f"the lines are of two satellites, {names}")
    try:
        twoline2rv(*lines, wgs72)  # which looks at every column
    except ValueError as error:
        form = str(error).splitlines()[-2:]
        what = f"{form[1]!r} is not of the form {form[0]!r}" if len(form) == 2 else str(error)
        raise ValueError(what) from None


def epoch_of(lines: Sequence[str]) -> datetime:
    """Return the epoch of the elements, UTC."""
    found: datetime = sat_epoch_datetime(_satellite(*lines)).replace(tzinfo=None)
    return found


def motion(lines: Sequence[str], epoch: datetime, time: Array) -> tuple[Array, Array]:
    """Return position [m] and velocity [m/s] from the Earth's centre, (n, 3) each, axes of TEME.

    ``time`` [s], (n,), is counted from ``epoch``, UTC.

    Raises:
        ValueError: SGP4 does not know the satellite at a time, as after its decay.
    """
    days = (epoch - _BEFORE) // timedelta(days=1)
    rest = (epoch - _BEFORE - timedelta(days=days)) / timedelta(days=1)
    whole = np.full(len(time), _JULIAN + days)
    errors, places, velocities = _satellite(*lines).sgp4_array(whole, rest + time / 86400.0)
    if errors.any():
        first = int(np.argmax(errors != 0))
        raise ValueError(f"at t = {time[first]:.6g} s, SGP4: {SGP4_ERRORS[int(errors[first])]}")
    return _KM * places, _KM * velocities


@functools.cache
def _satellite(first: str, second: str) -> Any:
    return Satrec.twoline2rv(first, second, WGS72)
