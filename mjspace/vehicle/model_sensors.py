"""The sensors that a user's own model has."""

import re
from keyword import iskeyword
from typing import Any, NamedTuple

import mujoco

from mjspace.contract import Measurement

_OF_FORCES = int(mujoco.mjtStage.mjSTAGE_ACC)
_HINGE = mujoco.mjtJoint.mjJNT_HINGE
_KIND = mujoco.mjtSensor
CARRIES = ("force", "torque")
"""Kinds of sensors that feel what is carried through them."""
FEELS_GRAVITY = ("accelerometer", "framelinacc", *CARRIES)
"""Kinds of sensors into which MuJoCo counts its gravity."""
PLACE, AXES, CENTRE = ":place", ":axes", ":centre"
"""Endings of the names of what tells of such a sensor where it is (3), its quaternion (4) and the
centre of mass of what it carries (3), in inertial axes."""
_UNITS = {
    **dict.fromkeys(("gyro", "frameangvel", "ballangvel"), "rad/s"),
    **dict.fromkeys(("velocimeter", "framelinvel", "subtreelinvel", "tendonvel"), "m/s"),
    **dict.fromkeys(("framepos", "subtreecom", "rangefinder", "tendonpos"), "m"),
    **dict.fromkeys(("accelerometer", "framelinacc"), "m/s^2"),
    **dict.fromkeys(("touch", "force", "tendonactfrc", "tendonlimitfrc"), "N"),
    "frameangacc": "rad/s^2",
    "torque": "N m",
    "subtreeangmom": "N m s",
    "clock": "s",
}
_OF_JOINTS = {
    "jointpos": ("rad", "m"),
    "jointvel": ("rad/s", "m/s"),
    "jointactfrc": ("N m", "N"),
    "jointlimitfrc": ("N m", "N"),
}
"""Units where the joint is a hinge, and where it is a slide."""


class ModelSensor(NamedTuple):
    """A sensor that the vehicle's model itself has."""

    name: str
    """As the model has it."""
    field: str
    """Of the measurement: the name with an underscore for what no name in Python or a log can have,
    and ``model_`` before it where that is taken."""
    kind: str
    """MuJoCo's: "gyro", "framequat", ...."""
    size: int
    """How many numbers it reports."""
    unit: str
    """Of what it reports; "" for numbers, and where MuJoCo leaves it open."""
    of_forces: bool
    """Whether it depends on forces, as an accelerometer does."""

    @property
    def is_attitude(self) -> bool:
        """Whether it reports a quaternion."""
        return self.kind in ("framequat", "ballquat")


def sensors_of(model: Any) -> tuple[ModelSensor, ...]:
    """Return the sensors of a compiled model whose sensors have names."""
    found = []
    taken = {"time", *Measurement.__annotations__}
    for i in range(model.nsensor):
        name = model.sensor(i).name
        plain = re.sub(r"\W|^(?=\d)", "_", name, flags=re.ASCII)
        if plain in taken or plain.startswith("_") or iskeyword(plain):
            plain = f"model_{plain}"
        while plain in taken:
            plain += "_"
        taken.add(plain)
        kind = _named(model.sensor_type[i])
        size, of_forces = int(model.sensor_dim[i]), model.sensor_needstage[i] == _OF_FORCES
        found.append(ModelSensor(name, plain, kind, size, _unit(model, i, kind), bool(of_forces)))
    return tuple(found)


def _unit(model: Any, sensor: int, kind: str) -> str:
    if kind not in _OF_JOINTS:
        return _UNITS.get(kind, "")
    of_hinge, of_slide = _OF_JOINTS[kind]
    return of_hinge if model.jnt_type[model.sensor_objid[sensor]] == _HINGE else of_slide


def add_places(spec: Any) -> None:
    """Add to a model with named sensors what tells where those are that feel gravity."""
    for sensor in list(spec.sensors):
        kind = _named(sensor.type)
        if kind not in FEELS_GRAVITY:
            continue
        name, where = sensor.name, {"objtype": sensor.objtype, "objname": sensor.objname}
        spec.add_sensor(name=name + PLACE, type=_KIND.mjSENS_FRAMEPOS, **where)
        spec.add_sensor(name=name + AXES, type=_KIND.mjSENS_FRAMEQUAT, **where)
        if kind in CARRIES:
            carried = spec.site(sensor.objname).parent.name
            body = {"objtype": mujoco.mjtObj.mjOBJ_BODY, "objname": carried}
            spec.add_sensor(name=name + CENTRE, type=_KIND.mjSENS_SUBTREECOM, **body)


def _named(kind: Any) -> str:
    name: str = _KIND(kind).name
    return name.removeprefix("mjSENS_").lower()
