"""Where a vehicle's joints, motors and sensors are in MuJoCo's arrays."""

import re
from collections.abc import Collection, Iterable
from typing import Any

import mujoco
import numpy as np

from mjspace.vehicle import stability

ENGINE = ("engine_outer", "engine_inner", "engine_thrust")
"""The motors of an engine on gimbals, in the order of ``ctrl``."""


def is_thruster(motor: str) -> bool:
    """Tell whether the motor of that name is a reaction-control thruster."""
    return re.fullmatch(r"thruster_\d+", motor) is not None


def of(model: Any, wheels: int, driven: Collection[str], *, engine: bool = False) -> dict[str, Any]:
    """Return ``plant.Vehicle``'s fields for that many reaction wheels, and ``driven`` hinges.

    With an ``engine``, its gimbals are gimbals, and its thrust is a motor. Reaction-control
    thrusters, which the model has or has not, are motors and come last.

    Raises:
        ValueError: no motor turns one of the hinges, or a motor is left without its drive.
        KeyError: a wheel or a sensor is not in the model.
    """
    reaction_wheels = [f"wheel_{index}" for index in range(wheels)]
    drives = _by_motor(model, driven)
    motors = [*reaction_wheels, *drives]
    if engine:
        motors, drives = _engine(model), list(ENGINE[:2])
    gimbals = [name for name in drives if not name.endswith("wheel")]
    driven_wheels = [name for name in drives if name not in gimbals]
    spun = [*reaction_wheels, *driven_wheels]
    return {
        "wheel_dof": _where(model.joint(name).dofadr for name in spun),
        "wheel_qpos": _where(model.joint(name).qposadr for name in driven_wheels),
        "gimbal_dof": _where(model.joint(name).dofadr for name in gimbals),
        "gimbal_qpos": _where(model.joint(name).qposadr for name in gimbals),
        "drive_dof": _where(model.joint(name).dofadr for name in drives),
        "motors": (*motors, *filter(is_thruster, _names(model))),
        "strut_qpos": _where(joint.qposadr for joint in _struts(model)),
        **{name: _sensor(model, name) for name in ("momentum", "kinetic", "environment")},
    }


def _by_motor(model: Any, driven: Collection[str]) -> list[str]:
    """Return the ``driven`` hinges in the order of their motors in ``ctrl``."""
    parts = turned(model)
    for name in driven:
        if name not in parts:
            raise ValueError(f"plant.drives.{name}: no motor turns it: have {', '.join(parts)}")
    if left := set(parts).difference(driven) if driven else ():
        raise ValueError(f"plant.drives: {', '.join(sorted(left))} has a motor and no drive")
    return parts if driven else []


def turned(model: Any) -> list[str]:
    """Return the parts' joints that motors turn, in the order of ``ctrl``; no deployed boom's."""
    plain = model.actuator_biastype == int(mujoco.mjtBias.mjBIAS_NONE)
    on_joints = np.flatnonzero(plain & (model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)))
    names = [model.joint(model.actuator_trnid[i, 0]).name for i in on_joints]
    return [name for name in names if not re.fullmatch(r"wheel_\d+", name)]


def axes(model: Any, dofs: Any) -> Any:
    """Return the hinges' unit axes with all joints at rest, body axes, shape (n, 3)."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bus = data.xmat[model.body("bus").id].reshape(3, 3)
    return data.xaxis[model.dof_jntid[dofs]] @ bus


def axial_inertia(model: Any, dofs: Any) -> Any:
    """Return the inertia [kg m^2] of all that each hinge turns, about its axis, shape (n,)."""
    return stability.mass_matrix(model)[dofs, dofs]


def _engine(model: Any) -> list[str]:
    """Return the engine's motors; they must be all that there are."""
    motors = [name for name in _names(model) if not is_thruster(name)]
    if motors != list(ENGINE):
        raise ValueError(
            f"plant.engine: wants the motors {', '.join(ENGINE)}, as plant.model = 'lander' has "
            f"them; here they are {', '.join(motors) or 'none'}"
        )
    return motors


def _names(model: Any) -> list[str]:
    """Return the names of all motors, in the order of ``ctrl``."""
    return [model.actuator(i).name for i in range(model.nu)]


def _struts(model: Any) -> list[Any]:
    joints = [model.joint(i) for i in range(model.njnt)]
    return [joint for joint in joints if joint.name.endswith("_strut")]


def _where(addresses: Iterable[Any]) -> Any:
    return frozen(np.array([address[0] for address in addresses], dtype=int))


def _sensor(model: Any, name: str) -> slice:
    sensor = model.sensor(name)
    return slice(int(sensor.adr[0]), int(sensor.adr[0] + sensor.dim[0]))


def frozen(array: Any) -> Any:
    """Return the array, which nobody can write to any more."""
    array.setflags(write=False)
    return array
