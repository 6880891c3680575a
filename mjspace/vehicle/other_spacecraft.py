"""Other spacecraft that fly beside the vehicle: their table, and their place in the model."""

from typing import Annotated, Any

import mujoco
import numpy as np
from pydantic import field_validator, model_validator

from mjspace.contract import Array
from mjspace.errors import input_error_at, nearest
from mjspace.scenario.fields import (
    Angles3,
    Matrix3,
    Meters3,
    Name,
    Positive,
    Quaternion,
    Rate3,
    Si,
    Table,
    Velocity3,
)
from mjspace.scenario.plant import PlantTable
from mjspace.scenario.ports import Port
from mjspace.vehicle import mass_properties, port_frames

_FREE = mujoco.mjtJoint.mjJNT_FREE
_Z_TO_X = np.array([0.5, 0.5, 0.5, 0.5])
_FOIL, _CELLS, _DARK = [0.78, 0.66, 0.38, 1.0], [0.09, 0.12, 0.3, 1.0], [0.15, 0.15, 0.17, 1.0]
_BEHIND = [-4.4, -3.4, 2.6]
"""Of the bus [m]: where the camera is that looks towards another spacecraft."""
_ROUNDING = 1e-9
"""Of the largest principal moment: by so much it may exceed the sum of the others, as a plate's."""


class OtherSpacecraft(Table):
    """A spacecraft that flies beside the vehicle without a law: a target, a CubeSat to deploy.

    It is a rigid body, or the body of that name of a model of one's own, which then states mass
    properties and ports itself. Where a connection is ``closed`` at first, its place, attitude and
    motion follow from the vehicle's.
    """

    mass: Annotated[Positive, Si("kg")] | None = None
    """Of a rigid body; of a model's body none."""
    inertia: Matrix3 | None = None
    """About its centre of mass, which is its origin, its own axes; goes with ``mass``."""
    size: Annotated[list[Positive], Si("m")] | None = None
    """Sides of the box that is drawn: (3,); those of a uniform box of its inertia when left out."""
    ports: dict[Name, Port] = {}
    """By a name of one's own; as sites they are called ``<spacecraft>_<port>``."""
    position: Meters3 | None = None
    """At time zero, of its origin, inertial axes; the model's when left out."""
    velocity: Velocity3 | None = None
    """At time zero, inertial axes; at rest when left out."""
    attitude: Quaternion | None = None
    """At time zero: quaternion, scalar first, its axes to inertial. Identity when left out."""
    euler: Angles3 | None = None
    """Or roll, pitch, yaw, as ``initial.euler``."""
    rate: Rate3 | None = None
    """Angular velocity at time zero, its own axes; none when left out."""

    @field_validator("inertia")
    @classmethod
    def _possible(cls, inertia: Any) -> Any:
        if inertia is None:
            return inertia
        moments = np.linalg.eigvalsh(np.array(inertia))
        excess = moments[2] - moments[1] - moments[0]
        if excess > _ROUNDING * moments[2]:
            three = ", ".join(f"{moment:.4g}" for moment in moments)
            raise ValueError(
                f"no rigid body has the principal moments {three} kg m^2: the largest exceeds the "
                f"sum of the others by {excess:.4g}"
            )
        return inertia

    @model_validator(mode="after")
    def _whole(self) -> "OtherSpacecraft":
        if (self.mass is None) != (self.inertia is None):
            raise ValueError("mass and inertia: give both or, of a body of the model, neither")
        if self.attitude is not None and self.euler is not None:
            raise ValueError("attitude and euler are both given: give one")
        if self.size is not None and len(self.size) != 3:
            raise ValueError(f"size: {len(self.size)} sides, should be 3")
        return self

    @property
    def starts_free(self) -> bool:
        """Whether any part of its place or motion at time zero is given."""
        given = (self.position, self.velocity, self.attitude, self.euler, self.rate)
        return any(each is not None for each in given)

    def attach(self, spec: Any, name: str, bus: Any) -> None:
        """Put it into the vehicle's ``MjSpec``, and a camera on the ``bus`` that looks at it.

        Raises:
            ValueError: the name is taken, or there is no such free body in the model.
        """
        body, key = spec.body(name), f"plant.spacecraft.{name}"
        if self.mass is not None:
            if body is not None:
                raise ValueError(f"{key}: the model has a body of that name: call it otherwise")
            if spec.joint(name) is not None:
                raise ValueError(f"{key}: the model has a joint of that name: call it otherwise")
            body = spec.worldbody.add_body(name=name)
            body.add_freejoint().name = name
            moments, iquat = mass_properties.principal(np.array(self.inertia))
            moments[2] = min(moments[2], moments[0] + moments[1])  # of a plate, but for rounding
            body.mass, body.inertia, body.explicitinertial = self.mass, moments, True
            body.ipos, body.iquat = np.zeros(3), iquat  # without a place it has no axes either
            if self.size is None:
                _draw(body, _uniform_box(self.mass, moments), iquat)
            else:
                _draw(body, self.size, np.array([1.0, 0.0, 0.0, 0.0]))
        elif body is None or not any(joint.type == _FREE for joint in body.joints):
            free = [each.parent.name for each in spec.joints if each.type == _FREE][1:]
            has = f"{nearest(name, free)}" if free else ": the model has none beside the vehicle"
            raise ValueError(f"{key}: give mass and inertia; no free body {name!r}{has}")
        add_ports(spec, self.ports, body, f"{key}.ports", f"{name}_")
        camera = bus.add_camera(name=f"towards_{name}", pos=_BEHIND, fovy=40.0, targetbody=name)
        camera.mode = mujoco.mjtCamLight.mjCAMLIGHT_TARGETBODY


def add_ports(spec: Any, ports: dict[str, Port], bus: Any, key: str, prefix: str = "") -> None:
    """Add a site for each of the ``ports``, to its body or else to the ``bus``.

    Its name is the port's behind the ``prefix``; ``key`` is the table's in the scenario.

    Raises:
        ValueError: there is no such body, or the name of a site is taken.
    """
    for own_name, port in ports.items():
        name, own_key = prefix + own_name, f"{key}.{own_name}"
        body = bus if port.body is None else spec.body(port.body)
        if body is None:
            have = [each.name for each in spec.bodies if each.name != "world"]
            raise ValueError(f"{own_key}: no body {port.body!r}{nearest(str(port.body), have)}")
        if spec.site(name) is not None:
            raise ValueError(f"{own_key}: there is a site {name!r} already: call it otherwise")
        site = body.add_site(name=name, pos=port.position, group=4)
        mujoco.mju_euler2Quat(site.quat, np.array(port.euler), "XYZ")  # about fixed axes
        ring = _drawn(body, mujoco.mjtGeom.mjGEOM_CYLINDER, [port.radius, 0.2 * port.radius, 0.0])
        ring.pos, ring.rgba = port.position, _DARK
        mujoco.mju_mulQuat(ring.quat, site.quat, _Z_TO_X)


def names_of(spec: Any) -> list[str]:
    """Return the names of the free bodies of an ``MjSpec`` but the first, which is the vehicle."""
    return [joint.parent.name for joint in spec.joints if joint.type == _FREE][1:]


def set_states(model: Any, plant: PlantTable, qpos: Array, qvel: Array) -> None:
    """Write the state at time zero of every other spacecraft into ``qpos`` (nq,), ``qvel`` (nv,).

    Those that begin docked move with the vehicle, whose own state is there already.

    Raises:
        ValueError: one that begins docked has a state of its own, or begins docked twice.
    """
    for name, table in plant.spacecraft.items():
        _set_state(model, table, name, qpos, qvel)
    docked: dict[str, str] = {}
    for connection, table in plant.connections.items():
        if not table.closed:
            continue
        with input_error_at(f"plant.connections.{connection}"):
            port_frames.check(model, table.between)
        body = model.body_rootid[model.site_bodyid[model.site(table.between[1]).id]]
        name = model.body(body).name
        own = plant.spacecraft.get(name)
        if own is not None and own.starts_free:
            raise ValueError(
                f"spacecraft.{name}: it begins docked, by connections.{connection}: leave out its "
                "position, velocity, attitude and rate"
            )
        if name in docked:
            raise ValueError(
                f"connections.{connection}: {name} begins docked by {docked[name]} already: set "
                "closed = false"
            )
        docked[name] = connection
        place, speed = _addresses(model, name)
        pose, motion = port_frames.docked(model, table.between, qpos, qvel)
        qpos[place : place + 7], qvel[speed : speed + 6] = pose, motion


def _set_state(model: Any, table: OtherSpacecraft, name: str, qpos: Array, qvel: Array) -> None:
    place, speed = _addresses(model, name)
    if table.position is not None:
        qpos[place : place + 3] = table.position
    if table.attitude is not None:
        qpos[place + 3 : place + 7] = np.array(table.attitude) / np.linalg.norm(table.attitude)
    elif table.euler is not None:
        euler = np.array(table.euler)
        mujoco.mju_euler2Quat(qpos[place + 3 : place + 7], euler, "XYZ")  # about fixed axes
    if table.velocity is not None:
        qvel[speed : speed + 3] = table.velocity
    if table.rate is not None:
        qvel[speed + 3 : speed + 6] = table.rate


def _addresses(model: Any, name: str) -> tuple[int, int]:
    """Return where the state of the free body of that name begins in ``qpos`` and ``qvel``."""
    joint = model.body_jntadr[model.body(name).id]
    return int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])


def _uniform_box(mass: float, moments: Array) -> Array:
    """Return the sides [m] of a uniform box, along the principal axes, of these ``moments``."""
    squares = 6.0 / mass * (moments.sum() - 2.0 * moments)
    sides: Array = np.sqrt(np.maximum(squares, 0.01 * squares.max()))
    return sides


def _draw(body: Any, size: Any, axes: Array) -> None:
    """Draw a box with these sides [m], along ``axes`` (4,) of the body, with cells on two faces."""
    half = 0.5 * np.array(size)
    box = mujoco.mjtGeom.mjGEOM_BOX
    hull, cells = _drawn(body, box, half), _drawn(body, box, half * [0.9, 1.02, 0.9])
    hull.quat, hull.rgba = axes, _FOIL
    cells.quat, cells.rgba = axes, _CELLS


def _drawn(body: Any, kind: Any, size: Any) -> Any:
    """Add a geom that is seen and has neither mass nor contacts."""
    geom = body.add_geom(type=kind, size=size)
    geom.mass, geom.contype, geom.conaffinity, geom.group = 0.0, 0, 0, 2
    return geom
