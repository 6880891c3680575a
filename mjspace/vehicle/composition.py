"""A vehicle's ``MjSpec``, composed from assets/: its model, its equipment, its parts."""

import warnings
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mjspace.errors import input_error_at, nearest
from mjspace.scenario.hinges import Hinge
from mjspace.scenario.model_source import ModelSource
from mjspace.scenario.mounted import Mounted
from mjspace.scenario.plant import Part, PlantTable
from mjspace.vehicle import (
    deployments,
    mass_properties,
    other_spacecraft,
    own_model,
    relative_motion,
)
from mjspace.vehicle.indices import ENVIRONMENT, KINETIC, MOMENTUM
from mjspace.vehicle.model_sensors import ModelSensor
from mjspace.vehicle.roles import Recognized

ASSETS = Path(str(files("mjspace.assets")))
"""The folder of the models and their parts."""
_CAMERA = "chase"
_VIEW = np.array([1.9, -0.95, 0.6])
"""From the bus to the camera, in extents of the vehicle."""
_LOOK = {
    "map": ("znear", "zfar"),
    "headlight": ("ambient", "diffuse", "specular"),
    "global_": ("offwidth", "offheight"),
}
"""What the surroundings need of MuJoCo's visual settings."""
_DRAWN_PANELS = ("bus_panel", "bus_frame", "bus_yoke")
_STOP_SPRING = [0.005, 1.0]  # s, damping ratio: of what turns there, whatever its inertia
_STOP_HARDNESS = [0.95, 0.99, 0.001, 0.5, 2.0]  # MuJoCo's solimp


class Composed(NamedTuple):
    """A vehicle before it is compiled."""

    spec: Any
    """Its ``MjSpec``: the model with equipment, parts and ground."""
    own: Recognized
    """What the motors of the model itself are."""
    relative: tuple[ModelSensor, ...]
    """Sensors of the motion of other spacecraft."""


def compose(table: PlantTable, source: ModelSource | None = None) -> Composed:
    """Return the vehicle of a ``table``; of a user's own model from its ``source``.

    Raises:
        ValueError: an unknown model, part or hinge; equipment that cannot be attached; a model of
            one's own that cannot fly.
    """
    with warnings.catch_warnings():
        # Files of ours are found where they are, also those of parts of a model that has its own.
        warnings.filterwarnings("ignore", "Attaching a child without asset dict")
        return _composed(table, source)


def _composed(table: PlantTable, source: ModelSource | None) -> Composed:
    if source is None:
        spec, own = _load(table.model), Recognized()
    else:
        with input_error_at(f"plant.model: {source.name}"):
            spec = own_model.read(source)
        with input_error_at("plant"):
            own, bare = own_model.prepare(
                spec,
                table.roles,
                lands=table.ground is not None,
                armature=not table.without_armature,
            )
        _add_surroundings(spec, bare)
    several = bool(table.spacecraft or other_spacecraft.names_of(spec))
    _add_sensors(spec, whole="world" if several else bus_of(spec).name)
    of_model = _joint_names(spec)
    _attach_equipment(spec, table, before_parts=True)
    of_equipment = _joint_names(spec) - of_model
    # Booms last: their motors, which no actuator drives, must not come between the others.
    for name, part in sorted(table.parts.items(), key=lambda item: item[1].deployment is not None):
        _attach_part(spec, name, part)
    for name, moving in table.moving_parts:
        bolt(spec, moving.build(), name, moving)
    if table.panels and source is None:
        _remove_drawn_panels(spec)
    for name, hinge in table.hinges.items():
        _bear(_hinge(spec, name, of_equipment), hinge)
    _attach_equipment(spec, table, before_parts=False)
    if table.ground is not None:
        table.ground.attach(spec)
    with input_error_at("plant.spacecraft"):
        for name, other in table.spacecraft.items():
            other.attach(spec, name, bus_of(spec))
    with input_error_at("plant.ports"):
        other_spacecraft.add_ports(spec, table.ports, bus_of(spec), "plant.ports")
    others = other_spacecraft.names_of(spec)
    relative = relative_motion.add_sensors(
        spec, bus_of(spec).name, others, table.connections, [each.field for each in own.sensors]
    )
    stops = any(hinge.stops for hinge in table.hinges.values())
    if stops:
        # The torques on a gimbal and on what carries it differ by the solver's remainder: at its
        # tolerance of 1e-8 an impact at 5 rad/s made 7e-8 N m s, now it makes 2e-13, in equal time.
        spec.option.tolerance = 0.0
    if spec.equalities or stops:
        # A model of free bodies needs no constraints; a cord that unwinds and a gimbal's stop do.
        spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    return Composed(spec, own, relative)


def bus_of(spec: Any) -> Any:
    """Return the body of the vehicle's ``MjSpec`` that the free joint moves."""
    free = (joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE)
    return next(free).parent


def part_names() -> list[str]:
    """Return the names of the parts to bolt to a bus: those with something that moves."""
    found = {path.parent.name: path for path in ASSETS.glob("parts/*/*.xml")}
    texts = {name: path.read_text(encoding="utf-8") for name, path in found.items()}
    return sorted(name for name, text in texts.items() if "<joint " in text)


def _load(name: str) -> Any:
    known = {path.parent.name: path for path in sorted(ASSETS.glob("*/scene.xml"))}
    if name not in known:
        raise ValueError(f"plant.model: no model {name!r}: have {', '.join(known)}")
    return mujoco.MjSpec.from_file(str(known[name]))


def _add_sensors(spec: Any, whole: str) -> None:
    """Add what the log has of the ``whole``: the tree of bodies on that one."""
    kind, body = mujoco.mjtSensor, mujoco.mjtObj.mjOBJ_BODY
    spec.add_sensor(name=MOMENTUM, type=kind.mjSENS_SUBTREEANGMOM, objtype=body, objname=whole)
    if whole == "world":
        name = relative_motion.CENTER_VELOCITY
        spec.add_sensor(name=name, type=kind.mjSENS_SUBTREELINVEL, objtype=body, objname=whole)
    spec.add_sensor(name=KINETIC, type=kind.mjSENS_E_KINETIC)
    spec.add_sensor(
        name=ENVIRONMENT, type=kind.mjSENS_USER, dim=6, needstage=mujoco.mjtStage.mjSTAGE_VEL
    )


def _add_surroundings(spec: Any, model: Any) -> None:
    """Add a camera to a user's model, which compiles to ``model``, and stars, sun and planet."""
    if spec.camera(_CAMERA) is None:
        place = _VIEW * max(float(model.stat.extent), 1e-3)
        backwards = place / np.linalg.norm(place)
        right = np.cross([0.0, 0.0, 1.0], backwards)
        right /= np.linalg.norm(right)
        camera = bus_of(spec).add_camera(name=_CAMERA, pos=place, fovy=40.0)
        camera.mode = mujoco.mjtCamLight.mjCAMLIGHT_TRACK
        axes = np.stack([right, np.cross(backwards, right), backwards], axis=-1)
        mujoco.mju_mat2Quat(camera.quat, axes.ravel())
    if any(texture.type == mujoco.mjtTexture.mjTEXTURE_SKYBOX for texture in spec.textures):
        return
    scenery = mujoco.MjSpec.from_file(str(ASSETS / "scenery/space.xml"))
    spec.stat.extent, spec.stat.center = scenery.stat.extent, scenery.stat.center
    for group, names in _LOOK.items():
        for name in names:
            value = getattr(getattr(scenery.visual, group), name)
            setattr(getattr(spec.visual, group), name, value)
    spec.attach(scenery, prefix="space_", frame=spec.worldbody.add_frame())
    spec.geom("space_planet").name = "planet"


def _attach_part(spec: Any, name: str, part: Part) -> None:
    if part.part not in part_names():
        raise ValueError(
            f"plant.parts.{name}.part: no part {part.part!r}: have {', '.join(part_names())}"
        )
    child = mujoco.MjSpec.from_file(str(ASSETS / f"parts/{part.part}/{part.part}.xml"))
    deployments.prepare(child, part)
    bolt(spec, child, name, part)


def bolt(spec: Any, child: Any, name: str, where: Mounted) -> None:
    """Attach the ``child``, its names with ``name`` before them, to the bus of ``spec``.

    Raises:
        ValueError: the compiler would change the mass of what is attached.
    """
    if spec.compiler.settotalmass > 0.0:
        raise ValueError(
            f"plant.model: its settotalmass, {spec.compiler.settotalmass:g} kg, would scale the "
            f"mass of {name} as well: leave it out and give the bodies their masses"
        )
    mount = bus_of(spec).add_frame(pos=where.position)
    mujoco.mju_euler2Quat(mount.quat, np.array(where.euler), "XYZ")  # about fixed axes
    spec.attach(child, prefix=f"{name}_", frame=mount)


def _remove_drawn_panels(spec: Any) -> None:
    """Remove the solar panels that are drawn on a bus of ours, rigid and without mass."""
    for geom in list(spec.geoms):
        if geom.classname.name in _DRAWN_PANELS:
            spec.delete(geom)


def _attach_equipment(spec: Any, table: PlantTable, *, before_parts: bool) -> None:
    for key, fitted in table.equipment.items():
        if fitted.before_parts == before_parts:
            with input_error_at(f"plant.{key}"):
                fitted.attach(spec)


def _joint_names(spec: Any) -> set[str]:
    return {joint.name for joint in spec.joints}


def _hinge(spec: Any, name: str, not_among: set[str]) -> Any:
    """Return the hinge of that name, of the model's own or the parts'."""
    hinges = [joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE]
    of_parts = {joint.name: joint for joint in hinges if joint.name not in not_among}
    if name not in of_parts:
        raise ValueError(f"plant.hinges.{name}: no such hinge{nearest(name, of_parts)}")
    return of_parts[name]


def _bear(joint: Any, hinge: Hinge) -> None:
    """Put the hinge's friction, imbalance and stops into the model; not its Coulomb friction."""
    viscous, *other = joint.damping
    joint.damping = [viscous + hinge.viscous_friction, *other]
    if hinge.static_imbalance or hinge.dynamic_imbalance:
        body, axis = joint.parent, joint.axis / np.linalg.norm(joint.axis)
        own = mass_properties.Inertial(
            body.mass, body.ipos, *mass_properties.principal(mass_properties.own_inertia(body))
        )
        body.mass, body.ipos, body.inertia, body.iquat = mass_properties.off_balance(
            own, axis, hinge, f"plant.hinges.{joint.name}"
        )
        body.fullinertia = np.full(6, np.nan)  # unset: the principal moments hold
    if hinge.stops:
        joint.limited = True
        joint.range = hinge.stops
        joint.solref_limit, joint.solimp_limit = _STOP_SPRING, _STOP_HARDNESS
