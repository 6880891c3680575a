"""What the vehicle's relative navigation measures: where other spacecraft and their ports are."""

import re
from collections.abc import Iterable
from typing import Any

import mujoco

from mjspace.contract import Measurement, Truth
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
_OF_EVERY_FLIGHT = (
    *(*Measurement.__annotations__, *Truth._fields, CENTER_VELOCITY),
    *("touchdown_velocity", "crash_velocity"),
)
"""Names that the measurement and ``/truth`` in the log have already, whatever flies."""


def add_sensors(
    spec: Any,
    bus: str,
    spacecraft: Iterable[str],
    connections: dict[str, Any],
    own: Iterable[str] = (),
) -> tuple[ModelSensor, ...]:
    """Let sensors report the motion of other ``spacecraft`` and at ``connections``, both by name.

    Of each spacecraft's origin, in the axes of the ``bus`` and from its origin: ``<name>_position``
    [m], ``<name>_attitude`` (quaternion, its axes to the bus's), ``<name>_velocity`` [m/s], the
    derivative of the position's components, and ``<name>_rate`` [rad/s]. Of each connection
    likewise the vehicle's port, in the axes of the other's. ``own`` are the fields of the
    measurement that are of the model's own sensors.

    Raises:
        ValueError: what is measured of two of them, or of one and of something else, would have
            one name.
    """
    taken = dict.fromkeys(_OF_EVERY_FLIGHT, "a name of mjspace's own")
    taken |= dict.fromkeys(own, "a sensor of plant.model")
    seen = [
        (f"plant.spacecraft.{name}", name, _OBJECT.mjOBJ_XBODY, (name, bus)) for name in spacecraft
    ]
    seen += [
        (f"plant.connections.{name}", name, _OBJECT.mjOBJ_SITE, tuple(table.between))
        for name, table in connections.items()
    ]
    added = []
    for key, name, kind, (measured, reference) in seen:
        fields = {quantity: _plain(f"{name}_{quantity}") for quantity in _KINDS}
        closed = [f"{name}_closed"] if kind == _OBJECT.mjOBJ_SITE else []
        for field in (*fields.values(), *closed):
            if field in taken or spec.sensor(field) is not None:
                owner = taken.get(field, "a sensor of plant.model")
                raise ValueError(f"{key}: {field} is {owner}: call it otherwise")
            taken[field] = f"measured of {key} too"
        for quantity, (sensor, size, unit) in _KINDS.items():
            spec.add_sensor(
                name=fields[quantity],
                type=getattr(mujoco.mjtSensor, f"mjSENS_{sensor.upper()}"),
                objtype=kind,
                objname=measured,
                reftype=kind,
                refname=reference,
            )
            field = fields[quantity]
            added.append(ModelSensor(field, field, sensor, size, unit, of_forces=False))
    return tuple(added)


def _plain(name: str) -> str:
    """Return a name as a field of the measurement can have it."""
    return re.sub(r"\W|^(?=\d)", "_", name)
