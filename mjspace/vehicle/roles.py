"""What the motors of a user's own model are, by their kinds and by the scenario's roles."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.errors import nearest
from mjspace.scenario.equipment import Driven
from mjspace.scenario.plant import Roles
from mjspace.vehicle.indices import bus_id
from mjspace.vehicle.model_sensors import ModelSensor, sensors_of

_ON_AXIS = 1e-3
"""How far a wheel's mass centre may be off its axis, as a share of its radius of gyration, and its
transverse moments from each other."""
_TRANSMISSION = mujoco.mjtTrn


@dataclass(frozen=True)
class Motor:
    """One of MuJoCo's actuators."""

    name: str
    drives: str
    """What it acts on: the name of a joint, tendon, site or body."""
    least: float
    """Of its command; -inf without a limit."""
    largest: float
    """Of its command; inf without a limit."""

    @property
    def either_way(self) -> float:
        """The largest command that it obeys in both directions; inf without a limit."""
        return min(-self.least, self.largest)


@dataclass(frozen=True)
class Recognized:
    """What the motors of a user's own model are; each has one role. The default has none."""

    wheels: tuple[Motor, ...] = ()
    """Torque motors of reaction wheels [N m]: of unlimited hinges whose body is balanced."""
    thrusters: tuple[Motor, ...] = ()
    """Forces at sites [N]."""
    others: tuple[Motor, ...] = ()
    """All others, which are commanded in MuJoCo's own terms."""
    gimbals: tuple[str, ...] = ()
    """Hinges that the others turn."""
    sensors: tuple[ModelSensor, ...] = ()
    """The model's own."""

    @property
    def driven(self) -> Driven:
        """What its motors drive, in the order in which their actuators act."""
        motors = (*self.wheels, *self.thrusters, *self.others)
        return Driven(
            motors=tuple(motor.name for motor in motors),
            gimbals=self.gimbals,
            wheels=tuple(motor.drives for motor in self.wheels),
        )


def recognize(model: Any, roles: Roles) -> Recognized:
    """Return what the motors of a compiled model with named motors are.

    Raises:
        ValueError: another joint comes before that of the vehicle, which is the first free body
            where ``roles`` names none; a pattern of
            ``roles`` matches no motor, or one that cannot have that role.
    """
    _check_bus(model, roles.bus)
    can_be_wheels = {i for i in range(model.nu) if _is_torque_motor(model, i)}
    can_be_thrusters = {i for i in range(model.nu) if _is_force_at_site(model, i)}
    wheels = _chosen(model, "wheels", roles.wheels, can_be_wheels, "torque motors of hinges")
    if roles.wheels is None:
        wheels = [i for i in sorted(can_be_wheels) if _is_wheel(model, i)]
    thrusters = _chosen(model, "thrusters", roles.thrusters, can_be_thrusters, "forces at sites")
    if roles.thrusters is None:
        thrusters = sorted(can_be_thrusters)
    others = [i for i in range(model.nu) if i not in {*wheels, *thrusters}]
    hinges = dict.fromkeys(
        model.actuator_trnid[i, 0]
        for i in others
        if model.actuator_trntype[i] == _TRANSMISSION.mjTRN_JOINT
        and model.jnt_type[model.actuator_trnid[i, 0]] == mujoco.mjtJoint.mjJNT_HINGE
    )
    return Recognized(
        wheels=tuple(_in_si(model, i) for i in wheels),
        thrusters=tuple(_in_si(model, i) for i in thrusters),
        others=tuple(_motor(model, i) for i in others),
        gimbals=tuple(model.joint(joint).name for joint in hinges),
        sensors=sensors_of(model),
    )


def scale(model: Any, motor: int) -> float:
    """Return the torque or force of a motor for each unit of its command: its gain times gear."""
    gear = model.actuator_gear[motor]
    size = gear[0]
    if model.actuator_trntype[motor] == _TRANSMISSION.mjTRN_SITE:
        size = np.linalg.norm(gear[:3])
    return float(size * model.actuator_gainprm[motor, 0])


def places_and_directions(model: Any, thrusters: Sequence[Motor]) -> tuple[Array, Array]:
    """Return where forces at sites act [m] and which way, body axes of the bus, joints at rest.

    Shapes (n, 3) and (n, 3).
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bus = bus_id(model)
    axes, origin = data.xmat[bus].reshape(3, 3), data.xpos[bus]
    places, ways = [], []
    for each in thrusters:
        motor = model.actuator(each.name).id
        site = model.actuator_trnid[motor, 0]
        places.append((data.site_xpos[site] - origin) @ axes)
        force = data.site_xmat[site].reshape(3, 3) @ model.actuator_gear[motor, :3]
        ways.append(force @ axes / np.linalg.norm(force))
    return np.reshape(places, (-1, 3)), np.reshape(ways, (-1, 3))


def _check_bus(model: Any, bus: str | None) -> None:
    free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
    vehicle = model.body(model.jnt_bodyid[free[0]]).name if bus is None else bus
    if model.body(model.jnt_bodyid[0]).name != vehicle:
        first = model.joint(0).name
        problem = f"the joint {first!r} comes before {vehicle!r}, which is free: put it first"
        raise ValueError(f"plant.model: {problem}")


def _chosen(
    model: Any, role: str, patterns: Sequence[str] | None, fit: set[int], what: str
) -> list[int]:
    """Return the motors whose name, or whose joint's or site's, matches one of the patterns.

    They are in the order of the patterns, and of the model.
    """
    found: dict[int, None] = {}
    for pattern in patterns or ():
        matched = [i for i in range(model.nu) if _matches(model, i, pattern)]
        have = [model.actuator(i).name for i in range(model.nu)]
        if not matched:
            raise ValueError(
                f"plant.roles.{role}: {pattern!r} matches no motor"
                f"{nearest(pattern, have) if have else ': the model has none'}"
            )
        for i in matched:
            if i not in fit:
                raise ValueError(
                    f"plant.roles.{role}: the motor {have[i]!r} cannot be one of the {role}, "
                    f"which are {what}"
                )
        found |= dict.fromkeys(matched)
    return list(found)


def _matches(model: Any, motor: int, pattern: str) -> bool:
    """Tell whether the name of the motor, or of what it acts on, matches."""
    names = model.actuator(motor).name, _target(model, motor)
    return any(name and fnmatchcase(name, pattern) for name in names)


def _target(model: Any, motor: int) -> str:
    kinds = {
        _TRANSMISSION.mjTRN_JOINT: model.joint,
        _TRANSMISSION.mjTRN_JOINTINPARENT: model.joint,
        _TRANSMISSION.mjTRN_TENDON: model.tendon,
        _TRANSMISSION.mjTRN_SITE: model.site,
        _TRANSMISSION.mjTRN_BODY: model.body,
        _TRANSMISSION.mjTRN_SLIDERCRANK: model.site,
    }
    kind = kinds.get(_TRANSMISSION(int(model.actuator_trntype[motor])))
    return str(kind(model.actuator_trnid[motor, 0]).name) if kind else ""


def _is_direct(model: Any, motor: int) -> bool:
    """Tell whether the motor's force is proportional to its command, at once."""
    return bool(
        model.actuator_gaintype[motor] == mujoco.mjtGain.mjGAIN_FIXED
        and model.actuator_biastype[motor] == mujoco.mjtBias.mjBIAS_NONE
        and model.actuator_dyntype[motor] == mujoco.mjtDyn.mjDYN_NONE
        and scale(model, motor) != 0.0
    )


def _is_torque_motor(model: Any, motor: int) -> bool:
    if model.actuator_trntype[motor] != _TRANSMISSION.mjTRN_JOINT:
        return False
    hinge = model.jnt_type[model.actuator_trnid[motor, 0]] == mujoco.mjtJoint.mjJNT_HINGE
    return bool(hinge) and _is_direct(model, motor)


def _is_force_at_site(model: Any, motor: int) -> bool:
    return bool(
        model.actuator_trntype[motor] == _TRANSMISSION.mjTRN_SITE
        and model.actuator_trnid[motor, 1] < 0  # not relative to another site
        and _is_direct(model, motor)
    )


def _is_wheel(model: Any, motor: int) -> bool:
    """Tell whether a torque motor turns a balanced body on the bus that may turn on and on."""
    joint = model.actuator_trnid[motor, 0]
    body, bus = model.jnt_bodyid[joint], bus_id(model)
    on_bus = model.body_weldid[model.body_parentid[body]] == model.body_weldid[bus]
    alone = model.body_dofnum[body] == 1 and not np.any(
        (model.body_parentid[1:] == body) & (model.body_dofnum[1:] > 0)
    )
    free_turning = not model.jnt_limited[joint] and not model.jnt_stiffness[joint]
    return bool(on_bus and alone and free_turning and _is_balanced(model, joint))


def _is_balanced(model: Any, joint: int) -> bool:
    """Tell whether the joint's body alone is symmetric about the axis, with its centre on it."""
    body, axis = model.jnt_bodyid[joint], model.jnt_axis[joint]
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.body_iquat[body])
    principal = rotation.reshape(3, 3)
    inertia = principal @ np.diag(model.body_inertia[body]) @ principal.T
    axial = axis @ inertia @ axis
    if not (model.body_mass[body] > 0.0 and axial > 0.0):
        return False
    offset = np.linalg.norm(np.cross(axis, model.body_ipos[body] - model.jnt_pos[joint]))
    radius = np.sqrt(axial / model.body_mass[body])
    # Of a symmetric body I = axial a a^T + transverse (1 - a a^T).
    transverse = 0.5 * (np.trace(inertia) - axial)
    symmetric = transverse * np.eye(3) + (axial - transverse) * np.outer(axis, axis)
    return bool(
        offset <= _ON_AXIS * radius and np.abs(inertia - symmetric).max() <= _ON_AXIS * axial
    )


def _motor(model: Any, motor: int) -> Motor:
    least, largest = _range(model, motor)
    return Motor(model.actuator(motor).name, _target(model, motor), least, largest)


def _in_si(model: Any, motor: int) -> Motor:
    """Return a motor that is commanded by its torque [N m] or force [N]."""
    of_command = _motor(model, motor)
    ends = [scale(model, motor) * end for end in (of_command.least, of_command.largest)]
    return replace(of_command, least=min(ends), largest=max(ends))


def _range(model: Any, motor: int) -> tuple[float, float]:
    """Return the limits of the motor's command, by its own range and that of its force."""
    least, largest = -np.inf, np.inf
    if model.actuator_ctrllimited[motor]:
        least, largest = model.actuator_ctrlrange[motor]
    if not _is_direct(model, motor):
        return float(least), float(largest)
    ranges = []
    if model.actuator_forcelimited[motor]:
        ranges.append(model.actuator_forcerange[motor] / model.actuator_gainprm[motor, 0])
    joint = model.actuator_trnid[motor, 0]
    on_joint = model.actuator_trntype[motor] == _TRANSMISSION.mjTRN_JOINT
    if on_joint and model.jnt_actfrclimited[joint]:
        ranges.append(model.jnt_actfrcrange[joint] / scale(model, motor))
    for one in ranges:
        least, largest = max(least, one.min()), min(largest, one.max())
    return float(least), float(largest)
