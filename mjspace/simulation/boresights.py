"""The angles of boresights from what must not be looked at, or must be: Sun, Moon, planet, limb."""

from collections.abc import Mapping

import numpy as np

from mjspace.contract import Array
from mjspace.scenario.boresight import Boresight
from mjspace.sensors import sky
from mjspace.sensors.base import Motion


def angles_at(
    motion: Motion, seen: Mapping[str, Array], boresights: Mapping[str, Boresight]
) -> dict[str, Array]:
    """Return the angles [rad] of each boresight at ``motion``, (..., 1), by their fields of /truth.

    ``seen`` has the directions of Sun and Moon in body axes, (..., 3), by their fields of /truth,
    as far as they are known. The planet's disc is that of a sphere of its equatorial radius.
    """
    found: dict[str, Array] = {}
    for name, boresight in boresights.items():
        axis = sky.unit(boresight.axis)
        off = _angle(sky.nadir(motion), axis)
        found |= {f"{name}_nadir_angle": off, f"{name}_limb_angle": off - sky.limb(motion)}
        for body in ("sun", "moon"):
            if f"{body}_direction" in seen:
                found[f"{name}_{body}_angle"] = _angle(seen[f"{body}_direction"], axis)
    return found


def _angle(vector: Array, axis: Array) -> Array:
    """Return the angle [rad] between ``vector`` (..., 3) and ``axis`` (3,), (..., 1).

    Exact for small angles too, where a cosine tells nothing.
    """
    normal = np.cross(vector, axis)
    sine = np.sqrt(np.sum(normal**2, axis=-1, keepdims=True))
    angle: Array = np.arctan2(sine, np.sum(vector * axis, axis=-1, keepdims=True))
    return angle
