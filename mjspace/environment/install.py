"""The vehicle's environment: packs a scenario's table for the native callbacks, and installs them.

The callbacks are inert until a vehicle's ``userdata`` asks for forces; a reset of MuJoCo's state
clears it, so that it must be written again afterwards.
"""

import functools
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjspace.contract import Array
from mjspace.environment import bearing_friction, central_gravity, kepler, kernel, struct_offsets
from mjspace.scenario.environment import DisturbanceTorque, Environment, Orbit
from mjspace.scenario.hinges import Friction
from mjspace.scenario.plant import Ripple

SENSOR = "environment"
"""Name of the user sensor (6 numbers, needstage "vel") that is given the environment's total on the
vehicle: force [N] in world axes, torque [N m] about its centre of mass in the bus's body axes."""

_NO_PASSIVE = int(mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER)


def install() -> None:
    """Make the native callbacks this process's ``mjcb_passive`` and ``mjcb_sensor``.

    Raises:
        RuntimeError: MuJoCo's structs are not laid out as it says.
    """
    passive, sensor = _callbacks()
    mujoco.set_mjcb_passive(passive.ctypes)
    mujoco.set_mjcb_sensor(sensor.ctypes)


@functools.cache
def _callbacks() -> tuple[Any, Any]:
    offsets = struct_offsets.find()
    return kernel.passive_callback(*offsets), kernel.sensor_callback(*offsets)


def userdata_size(
    environment: Environment, friction: Mapping[str, Friction], ripple: Mapping[str, Ripple] = {}
) -> int:
    """Return the ``nuserdata`` that a model needs for ``userdata`` with the same arguments.

    Raises:
        ValueError: the orbit meets the planet.
    """
    size = np.zeros(bearing_friction.WIDTH * len(friction))
    return kernel.HEADER + sum(block.size for block in _blocks(environment, size, ripple, {}))


def userdata(
    model: Any,
    environment: Environment,
    friction: Mapping[str, Friction],
    ripple: Mapping[str, Ripple] = {},
) -> Array:
    """Return a vehicle's ``userdata``, shape (model.nuserdata,).

    ``friction`` is the dry friction of hinges, ``ripple`` their motors' torque ripple, by name. The
    bus is the body of the first free joint.

    Raises:
        ValueError: the model has no free joint, no such hinge, no passive forces, too little
            userdata or another kind of sensor under our sensor's name; or the orbit meets the
            planet.
    """
    free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
    if free.size == 0:
        raise ValueError("the model has no free joint: the environment needs a bus to act on")
    if (model.opt.disableflags & _NO_PASSIVE) == _NO_PASSIVE:
        raise ValueError(
            "the model disables springs and dampers both, and so, in MuJoCo, every passive force, "
            "the environment among them: enable one"
        )
    needed = userdata_size(environment, friction, ripple)
    if model.nuserdata < needed:
        raise ValueError(f"the model's nuserdata is {model.nuserdata}: {needed} are needed")
    hinges = {name: _hinge(model, name) for name in (*friction, *ripple)}
    header = np.array([kernel.MAGIC, model.nv, model.jnt_dofadr[free[0]], _sensor_address(model)])
    dofs = [hinges[name][0] for name in friction]
    frictions = bearing_friction.pack(model, friction, dofs)
    packed = np.concatenate([header, *_blocks(environment, frictions, ripple, hinges)])
    return np.pad(packed, (0, model.nuserdata - packed.size))


def orbit_position(orbit: Orbit, time: ArrayLike) -> Array:
    """Return where the frame's origin is, from the planet's centre, in inertial axes [m].

    ``time`` [s] of shape (...) gives positions of shape (..., 3).

    Raises:
        ValueError: the orbit meets the planet.
    """
    times = np.asarray(time, dtype=np.float64)
    packed = kepler.pack(orbit)
    positions = [kepler.position(packed, instant) for instant in times.ravel()]
    return np.reshape(positions, (*times.shape, 3))


def _blocks(
    environment: Environment,
    friction: Array,
    ripple: Mapping[str, Ripple],
    hinges: Mapping[str, tuple[int, int]],
) -> list[Array]:
    """Return the terms' blocks; without ``hinges``, their (dof, place in qpos), of that size."""
    blocks = []
    if environment.magnetic_field is not None:  # field and moment are written as it flies
        blocks.append(_block(kernel.MAGNETIC, np.zeros(16)))
    if environment.orbit is not None:
        blocks.append(_block(kernel.ORBIT, kepler.pack(environment.orbit)))
    if environment.gravity is not None:
        blocks.append(_block(kernel.GRAVITY, central_gravity.pack(environment.gravity)))
    for torque in environment.torques:
        kind = kernel.BODY_TORQUE if torque.frame == "body" else kernel.INERTIAL_TORQUE
        blocks.append(_block(kind, _pack_torque(torque)))
    if friction.size:
        blocks.append(_block(kernel.FRICTION, friction))
    if ripple:
        rows = [
            (*hinges.get(name, (0, 0)), r.amplitude, r.cycles, r.phase)
            for name, r in ripple.items()
        ]
        blocks.append(_block(kernel.RIPPLE, np.ravel(rows)))
    return blocks


def _block(kind: float, payload: Array) -> Array:
    return np.concatenate([[kind, payload.size], payload])


def _pack_torque(torque: DisturbanceTorque) -> Array:
    series = [np.array(torque.bias)]
    for sine in torque.sines:
        amplitude, phase = np.array(sine.amplitude), np.array(sine.phase)
        series += [np.array([sine.frequency]), amplitude * np.cos(phase), amplitude * np.sin(phase)]
    return np.concatenate(series)


def _hinge(model: Any, name: str) -> tuple[int, int]:
    """Return the hinge's dof and its place in ``qpos``."""
    joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if joint < 0 or model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
        raise ValueError(f"friction or ripple: no hinge {name!r} in the model")
    return int(model.jnt_dofadr[joint]), int(model.jnt_qposadr[joint])


def _sensor_address(model: Any) -> int:
    sensor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, SENSOR)
    if sensor < 0:
        return -1
    user = model.sensor_type[sensor] == mujoco.mjtSensor.mjSENS_USER
    early = model.sensor_needstage[sensor] < int(mujoco.mjtStage.mjSTAGE_VEL)
    if not user or early or model.sensor_dim[sensor] != 6:
        raise ValueError(f'sensor {SENSOR!r} must be a user sensor with dim="6" needstage="vel"')
    return int(model.sensor_adr[sensor])
