"""Where a vehicle's joints, motors and sensors are in MuJoCo's arrays."""

from collections.abc import Collection, Iterable
from typing import Any

import mujoco
import numpy as np

from mjspace.scenario.equipment import Driven
from mjspace.vehicle import stability

MOMENTUM, KINETIC, ENVIRONMENT = "momentum", "kinetic", "environment"
"""Sensors of the whole vehicle; that of the environment is the environment's own."""


def of(model: Any, driven: Driven) -> dict[str, Any]:
    """Return the fields of ``Vehicle`` that tell where things are in ``model``.

    Raises:
        KeyError: one of the ``driven`` hinges or a sensor is not in the model.
    """
    return {
        "wheel_dof": _where(model.joint(name).dofadr for name in driven.wheels),
        "wheel_qpos": _where(model.joint(name).qposadr for name in driven.encoded_wheels),
        "gimbal_dof": _where(model.joint(name).dofadr for name in driven.gimbals),
        "gimbal_qpos": _where(model.joint(name).qposadr for name in driven.gimbals),
        "strut_qpos": _where(joint.qposadr for joint in _struts(model)),
        **{name: columns_of(model, name) for name in (MOMENTUM, KINETIC, ENVIRONMENT)},
    }


def bus_id(model: Any) -> int:
    """Return the body that the vehicle's free joint moves, which is the model's first joint."""
    return int(model.jnt_bodyid[0])


def turned(model: Any, others: Collection[str]) -> list[str]:
    """Return the joints that motors turn, in the order of ``ctrl``, but for deployed booms'.

    Those of the motors that are called as ``others`` are left out.
    """
    plain = model.actuator_biastype == int(mujoco.mjtBias.mjBIAS_NONE)
    on_joints = np.flatnonzero(plain & (model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)))
    ours = (i for i in on_joints if model.actuator(i).name not in others)
    return [model.joint(model.actuator_trnid[i, 0]).name for i in ours]


def axes(model: Any, dofs: Any) -> Any:
    """Return the hinges' unit axes with all joints at rest, body axes, shape (n, 3)."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bus = data.xmat[bus_id(model)].reshape(3, 3)
    return data.xaxis[model.dof_jntid[dofs]] @ bus


def axial_inertia(model: Any, dofs: Any) -> Any:
    """Return the inertia [kg m^2] of all that each hinge turns, about its axis, shape (n,)."""
    return stability.mass_matrix(model)[dofs, dofs]


def _struts(model: Any) -> list[Any]:
    joints = [model.joint(i) for i in range(model.njnt)]
    return [joint for joint in joints if joint.name.endswith("_strut")]


def _where(addresses: Iterable[Any]) -> Any:
    return frozen(np.array([address[0] for address in addresses], dtype=int))


def columns_of(model: Any, name: str) -> slice:
    """Return where the sensor of that name stands in a row of MuJoCo's sensors."""
    sensor = model.sensor(name)
    return slice(int(sensor.adr[0]), int(sensor.adr[0] + sensor.dim[0]))


def frozen(array: Any) -> Any:
    """Return the array after making it read-only."""
    array.setflags(write=False)
    return array
