"""Packs what acts on a vehicle for the native callbacks, and installs them.

The callbacks are inert until a vehicle's ``userdata`` holds terms. A reset of MuJoCo's state clears
it, so that it must be written again afterwards.
"""

import functools
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from mjspace.compiling import first_use
from mjspace.contract import Array
from mjspace.environment import joints, kernel, struct_offsets
from mjspace.environment.base import HEADER, MAGIC, Term
from mjspace.environment.terms import terms_of
from mjspace.scenario.environment import Environment
from mjspace.scenario.plant import PlantTable

SENSOR = "environment"
"""Name of the user sensor (6 numbers, needstage "vel") that reports the environment's total on the
vehicle: force [N] in world axes, torque [N m] about its centre of mass in the bus's body axes."""

_FUNCTIONS = 77  # that numba compiles for the callbacks, counted with numba 0.68
_NO_PASSIVE = int(mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER)


def install_callbacks() -> None:
    """Make the native callbacks this process's ``mjcb_passive`` and ``mjcb_sensor``.

    Raises:
        RuntimeError: MuJoCo's structs are not laid out as it declares.
    """
    passive, sensor = _callbacks()
    mujoco.set_mjcb_passive(passive.ctypes)
    mujoco.set_mjcb_sensor(sensor.ctypes)


@functools.cache
def _callbacks() -> tuple[Any, Any]:
    offsets = struct_offsets.find()
    version = kernel.version_of_terms()
    with first_use(kernel.__file__, "the environment", _FUNCTIONS):
        return kernel.passive_callback(*offsets, version), kernel.sensor_callback(*offsets)


def userdata_size(environment: Environment, plant: PlantTable | None = None) -> int:
    """Return the ``nuserdata`` that a model needs for ``userdata`` with the same arguments."""
    return HEADER + sum(2 + term.payload_size(environment) for term in terms_of(environment, plant))


def places_of(kind: type[Term], environment: Environment, plant: PlantTable) -> list[int]:
    """Return where in ``userdata`` the parameters of each term of that ``kind`` begin."""
    return [at for term, at in _places(environment, plant) if isinstance(term, kind)]


def places_read(name: str, environment: Environment, plant: PlantTable) -> list[int]:
    """Return where in ``userdata`` terms read what is written in flight under that ``name``."""
    places = _places(environment, plant)
    return [at + term.reads[name] for term, at in places if name in term.reads]


def _places(environment: Environment, plant: PlantTable) -> Iterator[tuple[Term, int]]:
    """Yield each term and where its parameters begin in ``userdata``."""
    place = HEADER
    for term in terms_of(environment, plant):
        yield term, place + 2
        place += 2 + term.payload_size(environment)


def userdata(model: Any, environment: Environment, plant: PlantTable | None = None) -> Array:
    """Return a vehicle's ``userdata``, shape (model.nuserdata,).

    It holds the ``environment`` and what acts in the hinges of the ``plant``. The bus is the body
    of the first free joint.

    Raises:
        ValueError: the model has no free joint, lacks a hinge, has no passive forces, too little
            userdata or another kind of sensor under our sensor's name.
    """
    dof, _ = joints.bus(model)
    if (model.opt.disableflags & _NO_PASSIVE) == _NO_PASSIVE:
        raise ValueError(
            "the model disables springs and dampers both, and so, in MuJoCo, every passive force, "
            "the environment among them: enable one"
        )
    needed = userdata_size(environment, plant)
    if model.nuserdata < needed:
        raise ValueError(f"the model's nuserdata is {model.nuserdata}: {needed} are needed")
    header = np.array([MAGIC, model.nv, dof, _sensor_address(model)])
    blocks = [_block(term, model, environment) for term in terms_of(environment, plant)]
    packed = np.concatenate([header, *blocks])
    return np.pad(packed, (0, model.nuserdata - packed.size))


def _block(term: Term, model: Any, environment: Environment) -> Array:
    payload, size = term.pack(model, environment), term.payload_size(environment)
    if payload.shape != (size,):
        raise ValueError(
            f"{type(term).__name__}.pack returned an array of shape {payload.shape}, should be "
            f"({size},), its payload_size"
        )
    return np.concatenate([[term.block_kind(), payload.size], payload])


def _sensor_address(model: Any) -> int:
    sensor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, SENSOR)
    if sensor < 0:
        return -1
    user = model.sensor_type[sensor] == mujoco.mjtSensor.mjSENS_USER
    early = model.sensor_needstage[sensor] < int(mujoco.mjtStage.mjSTAGE_VEL)
    if not user or early or model.sensor_dim[sensor] != 6:
        raise ValueError(f'sensor {SENSOR!r} must be a user sensor with dim="6" needstage="vel"')
    return int(model.sensor_adr[sensor])
