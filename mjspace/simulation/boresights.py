"""The angles of boresights from what must not be looked at, or must be: Sun, Moon, planet, limb."""

from collections.abc import Mapping

from mjspace.contract import Array
from mjspace.scenario.boresight import Boresight
from mjspace.sensors import sky
from mjspace.sensors.base import Motion


def angles_at(
    motion: Motion, bodies: Mapping[str, Array], boresights: Mapping[str, Boresight]
) -> dict[str, Array]:
    """Return the angles [rad] of each boresight at ``motion``, (..., 1), by their fields of /truth.

    ``bodies`` has the directions of Sun and Moon in body axes, (..., 3), by their fields of /truth,
    as far as they are known. The planet's disc is that of a sphere of its equatorial radius.
    """
    found: dict[str, Array] = {}
    for name, boresight in boresights.items():
        axis = sky.unit(boresight.axis)
        off = sky.from_axis(sky.nadir(motion), axis)
        found |= {f"{name}_nadir_angle": off, f"{name}_limb_angle": off - sky.limb(motion)}
        for body in ("sun", "moon"):
            if f"{body}_direction" in bodies:
                found[f"{name}_{body}_angle"] = sky.from_axis(bodies[f"{body}_direction"], axis)
    return found
