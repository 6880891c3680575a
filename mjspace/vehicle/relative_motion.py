"""What the vehicle's relative navigation measures: where other spacecraft and their ports are."""

import re
from collections.abc import Iterable
from typing import Any

import mujoco

from mjspace.vehicle.model_sensors import ModelSensor

CENTER_VELOCITY = "center_velocity"
"""Sensor of the velocity of the centre of mass of all that flies, inertial axes [m/s]."""
_KINDS = {
    "position": ("framepos", 3, "m"),
    "attitude": ("framequat", 4, ""),
    "velocity": ("framelinvel", 3, "m/s"),
    "rate": ("frameangvel", 3, "rad/s"),
}
_OBJECT = mujoco.mjtObj


def add_sensors(
    spec: Any, bus: str, spacecraft: Iterable[str], connections: dict[str, Any]
) -> tuple[ModelSensor, ...]:
    """Let sensors report the motion of other ``spacecraft`` and at ``connections``, both by name.

    Of each spacecraft's origin, in the axes of the ``bus`` and from its origin: ``<name>_position``
    [m], ``<name>_attitude`` (quaternion, its axes to the bus's), ``<name>_velocity`` [m/s], the
    derivative of the position's components, and ``<name>_rate`` [rad/s]. Of each connection
    likewise the vehicle's port, in the axes of the other's.

    Raises:
        ValueError: the model has a sensor of such a name.
    """
    pairs = {name: ((_OBJECT.mjOBJ_XBODY, name), (_OBJECT.mjOBJ_XBODY, bus)) for name in spacecraft}
    for name, table in connections.items():
        port, other = table.between
        pairs[name] = ((_OBJECT.mjOBJ_SITE, port), (_OBJECT.mjOBJ_SITE, other))
    added = []
    for name, ((kind, measured), (reference, seen_from)) in pairs.items():
        for quantity, (sensor, size, unit) in _KINDS.items():
            plain = re.sub(r"\W|^(?=\d)", "_", f"{name}_{quantity}")
            if spec.sensor(plain) is not None:
                raise ValueError(f"plant.model: the sensor {plain!r} has the name of one of ours")
            spec.add_sensor(
                name=plain,
                type=getattr(mujoco.mjtSensor, f"mjSENS_{sensor.upper()}"),
                objtype=kind,
                objname=measured,
                reftype=reference,
                refname=seen_from,
            )
            added.append(ModelSensor(plain, plain, sensor, size, unit, of_forces=False))
    return tuple(added)
