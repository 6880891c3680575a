"""What the caption of a frame says: the time, and what matters of the flight then."""

from collections.abc import Iterator

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
        if "altitude" in truth:
            place, named = "altitude", "altitude"
        elif port is not None:
            place, velocity = f"{port}_position", f"{port}_velocity"
        off = rows("position_error") if "position_error" in truth else (None for _ in times)
        for at, moving, error in zip(rows(place), rows(velocity), off, strict=True):
            yield path_text(named, at, moving, error)
    elif law in TURNING:
        for rate in rows("rate"):
            yield f"turns at {rate_text(rate)}"
    else:
        for error, rate in zip(rows("attitude_error"), rows("rate"), strict=True):
            yield f"attitude error {angle_text(float(error[0]))}, rate {rate_text(rate)}"


def flies_a_path(log: Log) -> bool:
    """Tell whether a lander flew, or one spacecraft near another."""
    own = {"altitude", "position_error"} & log.topics.get("/truth", {}).keys()
    return bool(own) or _port(log) is not None


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


def path_text(named: str, place: Array, velocity: Array, error: Array | None) -> str:
    """Return a distance, a speed [m/s] and the distance from the desired path [m].

    Each is the norm of a vector; the first of ``place`` [m], (n,), is ``named`` so.
    """
    away = float(np.linalg.norm(place))
    distance = f"{away:.2f} m" if away < 100.0 else f"{away:.1f} m"
    text = f"{named} {distance}, speed {np.linalg.norm(velocity):.2f} m/s"
    return text if error is None else f"{text}, {np.linalg.norm(error):.2f} m off its path"


def _number(value: float) -> str:
    return f"{value:.2f}" if value >= 0.01 else f"{value:.2g}"
