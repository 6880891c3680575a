"""What the caption of a frame says: the time, and what matters of the flight then."""

from collections.abc import Iterable, Iterator
from itertools import repeat

import numpy as np

from mjspace.contract import Array
from mjspace.log.reader import Log
from mjspace.rendering.sampling import nearest_rows

TURNING = frozenset(
    {
        *("coast:Coast", "quaternion_feedback:RateDamping", "magnetic:BDot"),
        *("spinner:SpinUp", "spinner:RhumbLine"),
    }
)
"""Laws that leave the attitude alone: their flights have a rate, and no error of the attitude."""
_DOCKED = "_closed"  # ending of the field of /truth that tells whether a connection is closed


def captions(log: Log, law: str, times: Array) -> Iterator[str]:
    """Yield the caption at each of the ascending ``times`` (n,) [s], of a flight of that ``law``.

    Of a lander altitude and speed, of two spacecraft the distance between their ports or else from
    the frame's origin, where the target is; of both the distance from the desired path. Of a
    vehicle whose attitude is controlled the error and the rate, of another the rate alone.
    """
    truth = log.topics.get("/truth", {})

    def rows(field: str) -> Iterator[Array]:
        return nearest_rows(log, "/truth", field, times)

    port = _port(log)
    if flies_a_path(log):
        place, velocity, named = "position", "velocity", "distance"
        if is_lander(log):
            place, named = "altitude", "altitude"
        elif port is not None:
            place, velocity = f"{port}_position", f"{port}_velocity"
        of = ""
        errors: Iterable[Array] = repeat(np.zeros(3), len(times))
        if "position_error" in truth:
            of, errors = _what_is_desired(log), rows("position_error")
        for at, moving, error in zip(rows(place), rows(velocity), errors, strict=True):
            text = path_text(named, at, moving)
            yield f"{text}, {metres(error)} {of}" if of else text
    elif law in TURNING:
        for rate in rows("rate"):
            yield f"turns at {rate_text(rate)}"
    else:
        for error, rate in zip(rows("attitude_error"), rows("rate"), strict=True):
            yield f"attitude error {angle_text(float(error[0]))}, rate {rate_text(rate)}"


def flies_a_path(log: Log) -> bool:
    """Tell whether a lander flew, or one spacecraft near another."""
    near_another = "position_error" in log.topics.get("/truth", {}) or _port(log) is not None
    return near_another or is_lander(log)


def is_lander(log: Log) -> bool:
    """Tell whether the vehicle had ground below it."""
    return {"altitude", "contact"} <= log.topics.get("/truth", {}).keys()


def _what_is_desired(log: Log) -> str:
    """Return what the position error is from: a path, or one place throughout."""
    first, last = (log.nearest("/reference", at)["position"] for at in (log.start, log.end))
    return "from its desired place" if np.array_equal(first, last) else "off its path"


def _port(log: Log) -> str | None:
    """Return the name of the first connection to another spacecraft."""
    names = [name for name in log.topics.get("/truth", {}) if name.endswith(_DOCKED)]
    return names[0].removesuffix(_DOCKED) if names else None


def time_text(time: float, span: float) -> str:
    """Return a time [s] of a flight that lasts ``span`` [s]: in min from 10 min, in h from 3 h."""
    if span < 600.0:
        return f"{time:.2f} s"
    minutes, seconds = divmod(round(time), 60)
    if span < 3 * 3600.0:
        return f"{minutes} min {seconds:02} s"
    return f"{minutes // 60} h {minutes % 60:02} min"


def angle_text(angle: float) -> str:
    """Return an angle [rad] in degrees: two decimals, or two digits below 0.01 deg."""
    return f"{_number(float(np.degrees(angle)))} deg"


def rate_text(rate: Array) -> str:
    """Return the size of a rate (3,) [rad/s] in degrees a second."""
    return f"{_number(float(np.degrees(np.linalg.norm(rate))))} deg/s"


def metres(vector: Array) -> str:
    """Return the length of a vector (n,) [m], from 10 km on in km."""
    length = float(np.linalg.norm(vector))
    if length >= 1e4:
        return f"{1e-3 * length:.1f} km"
    return f"{length:.2f} m" if length < 100.0 else f"{length:.1f} m"


def path_text(named: str, place: Array, velocity: Array) -> str:
    """Return the lengths of ``place`` [m], which is ``named`` so, and of a velocity [m/s]."""
    return f"{named} {metres(place)}, speed {np.linalg.norm(velocity):.2f} m/s"


def _number(value: float) -> str:
    return f"{value:.2f}" if value >= 0.01 else f"{value:.2g}"
