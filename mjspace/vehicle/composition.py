"""A vehicle's ``MjSpec``, composed from assets/: its model, its wheels, its other parts."""

import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.errors import nearest
from mjspace.scenario.hinges import Hinge
from mjspace.scenario.landing import Ground
from mjspace.scenario.plant import Part, PlantTable
from mjspace.scenario.thrusters import Rcs
from mjspace.vehicle import ground_contact, mass_properties
from mjspace.vehicle.deployments import Deployment

_ASSETS = Path(str(files("mjspace.assets")))
_STOP_SPRING = [0.005, 1.0]  # s, damping ratio: of what turns there, whatever its inertia
_STOP_HARDNESS = [0.95, 0.99, 0.001, 0.5, 2.0]  # MuJoCo's solimp
_HYDRAZINE = 1010.0  # kg/m^3 at 20 deg C
_UNSEEN = 5  # a group of sites that no picture shows
_NOZZLE_AND_PLUME = (
    # name, shape, size [m], how far out its centre is [m], color
    ("nozzle", mujoco.mjtGeom.mjGEOM_CYLINDER, [0.03, 0.035, 0.0], 0.03, [0.15, 0.15, 0.17, 1.0]),
    ("plume", mujoco.mjtGeom.mjGEOM_ELLIPSOID, [0.06, 0.06, 0.26], 0.3, [0.5, 0.72, 1.0, 0.0]),
)
_WHEEL_GAP = 0.1  # m, between the hull and the centre of a wheel drawn outside it


def compose(table: PlantTable) -> Any:
    """Return the vehicle's ``MjSpec``: wheels first, so that their speeds and motors are.

    Raises:
        ValueError: an unknown model, part or hinge; wheels that no rotor can be.
    """
    spec = _load(table.model)
    for index in range(len(table.wheels.axes)):
        _attach_wheel(spec, table, index)
    # Booms last: their motors, which no actuator drives, must not come between the others.
    for name, part in sorted(table.parts.items(), key=lambda item: item[1].deployment is not None):
        _attach_part(spec, name, part)
    for name, hinge in table.hinges.items():
        _bear(_hinge(spec, name), hinge)
    if table.rcs is not None:
        _add_thrusters(spec, table.rcs)
    if table.ground is not None:
        _attach_ground(spec, table.ground)
    stops = any(hinge.stops for hinge in table.hinges.values())
    if stops:
        # The torques on a gimbal and on what carries it differ by the solver's remainder: at its
        # tolerance of 1e-8 an impact at 5 rad/s made 7e-8 N m s, now it makes 2e-13, in equal time.
        spec.option.tolerance = 0.0
    if spec.equalities or stops:
        # A model of free bodies does without; a cord that unwinds and a gimbal's stop do not.
        spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    return spec


def part_names() -> list[str]:
    """Return the names of the parts to bolt to a bus: those with something that moves."""
    found = {path.parent.name: path for path in _ASSETS.glob("parts/*/*.xml")}
    return sorted(name for name, path in found.items() if "<joint " in path.read_text())


def _load(name: str) -> Any:
    scene = _ASSETS / name / "scene.xml"
    if not scene.is_file():
        known = ", ".join(sorted(path.parent.name for path in _ASSETS.glob("*/scene.xml")))
        raise ValueError(f"plant.model: no model {name!r}: have {known}")
    return mujoco.MjSpec.from_file(str(scene))


def _attach_wheel(spec: Any, table: PlantTable, index: int) -> None:
    """Bolt wheel ``index`` to the bus, its z axis along the spin axis."""
    wheels, name = table.wheels, f"wheel_{index}"
    axis = mass_properties.unit_axes(wheels)[index]
    part = mujoco.MjSpec.from_file(str(_ASSETS / "parts/reaction_wheel/reaction_wheel.xml"))
    rotor, joint, motor = part.body("rotor"), part.joint("spin"), part.actuator("motor")
    rotor.mass, rotor.ipos, rotor.inertia, rotor.iquat = mass_properties.rotor(wheels)
    joint.damping = [wheels.viscous_friction, 0.0, 0.0]  # linear, quadratic, cubic
    if wheels.torque_limit is not None:
        motor.ctrllimited = True
        motor.ctrlrange = [-wheels.torque_limit, wheels.torque_limit]

    mount = spec.body("bus").add_frame()
    mujoco.mju_quatZ2Vec(mount.quat, axis)
    if wheels.positions is not None:
        mount.pos = wheels.positions[index]
    else:
        reach = _exit(spec.geom("bus_hull").size, axis) + _WHEEL_GAP
        for geom in part.geoms:
            geom.pos[2] += reach
    spec.attach(part, prefix=f"{name}_", frame=mount)
    rotor.name = joint.name = motor.name = motor.target = name


def _attach_part(spec: Any, name: str, part: Part) -> None:
    if part.part not in part_names():
        raise ValueError(
            f"plant.parts.{name}.part: no part {part.part!r}: have {', '.join(part_names())}"
        )
    child = mujoco.MjSpec.from_file(str(_ASSETS / f"parts/{part.part}/{part.part}.xml"))
    mount = spec.body("bus").add_frame(pos=part.position)
    mujoco.mju_euler2Quat(mount.quat, np.array(part.euler), "XYZ")  # about fixed axes
    if part.deployment is not None:
        stow = {"boom": _drive_out, "yo_yo": _hold}[part.part]
        stow(child, part.deployment)
    spec.attach(child, prefix=f"{name}_", frame=mount)


def _drive_out(boom: Any, deployment: Deployment) -> None:
    """Make the boom's motor a position loop, which MuJoCo closes in every stage."""
    drive, tip, w = boom.actuator("drive"), boom.body("tip"), deployment.bandwidth
    drive.gainprm[0] = tip.mass * w**2
    drive.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    drive.biasprm[:3] = [0.0, -tip.mass * w**2, -2.0 * tip.mass * w]


def _hold(yo_yo: Any, deployment: Deployment) -> None:
    """Hold the weight where little of its cord is off the drum."""
    held = yo_yo.equality("held")
    held.active = True
    held.data[0] = deployment.unwound - yo_yo.joint("unwind").ref


def _hinge(spec: Any, name: str) -> Any:
    """Return the hinge of that name among the parts'."""
    hinges = [joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_HINGE]
    of_parts = {j.name: j for j in hinges if not re.fullmatch(r"wheel_\d+", j.name)}
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
        body.fullinertia = np.full(6, np.nan)  # not given: the principal moments are
    if hinge.stops:
        joint.limited = True
        joint.range = hinge.stops
        joint.solref_limit, joint.solimp_limit = _STOP_SPRING, _STOP_HARDNESS


def _add_thrusters(spec: Any, rcs: Rcs) -> None:
    """Let each thruster push on the bus at its place; put the propellant at the body origin.

    Its plume is a shape that nobody sees until a picture shows it.
    """
    bus = spec.body("bus")
    spec.add_material(name="thruster", emission=0.8)
    for index, (place, way) in enumerate(zip(rcs.positions, rcs.unit_directions, strict=True)):
        name = f"thruster_{index}"
        bus.add_site(name=name, pos=place, group=_UNSEEN)
        pushes = {"trntype": mujoco.mjtTrn.mjTRN_SITE, "target": name}
        spec.add_actuator(name=name, gear=[*way, 0.0, 0.0, 0.0], **pushes)
        out = -np.array(way)
        for drawn, kind, size, ahead, color in _NOZZLE_AND_PLUME:
            geom = bus.add_geom(type=kind, size=size, pos=place + ahead * out, rgba=color)
            geom.name, geom.group, geom.mass = f"{name}_{drawn}", 2, 0.0
            geom.contype = geom.conaffinity = 0
            geom.material = "thruster" if drawn == "plume" else ""
            mujoco.mju_quatZ2Vec(geom.quat, out)
    if rcs.propellant is not None:
        radius = np.cbrt(rcs.propellant / (4.0 / 3.0 * np.pi * _HYDRAZINE))
        tank = bus.add_body(name="rcs_tank", mass=rcs.propellant, explicitinertial=True)
        tank.inertia = np.full(3, 0.4 * rcs.propellant * radius**2)


def _attach_ground(spec: Any, ground: Ground) -> None:
    """Lay the ground through the origin, sloping down towards ``downhill``."""
    file = _ASSETS / f"parts/{ground.part}/{ground.part}.xml"
    if not file.is_file():
        known = ", ".join(sorted(path.parent.name for path in _ASSETS.glob("parts/moon_*/*.xml")))
        raise ValueError(f"plant.ground.part: no part {ground.part!r}: have {known}")
    across = [-np.sin(ground.downhill), np.cos(ground.downhill), 0.0]
    frame = spec.worldbody.add_frame()
    mujoco.mju_axisAngle2Quat(frame.quat, np.array(across), ground.slope)
    spec.attach(mujoco.MjSpec.from_file(str(file)), prefix="site_", frame=frame)
    ground_contact.add_sensors(spec, "site_ground")


def _exit(half_size: Array, axis: Array) -> float:
    """Return how far from its centre [m] a ray along ``axis`` leaves a box of that half size."""
    with np.errstate(divide="ignore"):
        return float(np.min(half_size / np.abs(axis)))
