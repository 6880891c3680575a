"""Native callbacks for MuJoCo that add the environment's terms inside its stages (numba).

A model whose userdata does not start with MAGIC and its own number of dofs is left alone.
"""

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numba import cfunc, types
from numba.np.numpy_support import carray

from mjspace.environment.base import HEADER, MAGIC
from mjspace.environment.bodies import Bodies
from mjspace.environment.compiled import compiled
from mjspace.environment.native_memory import floats, ints
from mjspace.environment.struct_offsets import DataOffsets, ModelOffsets
from mjspace.environment.terms import kernels

_STAGE_VELOCITY = 2  # mjSTAGE_VEL: passive forces are known from it on


def version_of_terms() -> int:
    """Return a number, not 0, that differs with any change of this room's files."""
    files = sorted(Path(__file__).parent.glob("*.py"))
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in files)).digest()
    return int.from_bytes(digest[:7]) | 1


def chain(kernels: Sequence[tuple[int, compiled]]) -> compiled:
    """Return a compiled function of (kind, payload, time, bodies) that calls the kind's kernel.

    Each link compares one kind and calls the next link: numba inlines them to one chain of
    branches. Other kinds are passed over.
    """
    if not kernels:
        return compiled(lambda kind, payload, time, bodies: None)
    (number, kernel), *others = kernels
    rest = chain(others)

    @compiled
    def link(kind: float, payload: Any, time: float, bodies: Bodies) -> None:
        if kind == number:
            kernel(payload, time, bodies)
        else:
            rest(kind, payload, time, bodies)

    return link


_add_term = chain(list(kernels().items()))


@compiled
def add_forces(userdata: Any, time: float, bodies: Bodies) -> None:
    """Add every term that ``userdata`` holds, at ``time`` [s], to ``qfrc_passive``."""
    block = HEADER
    while block + 2 <= userdata.size and userdata[block] != 0.0:
        end = block + 2 + int(userdata[block + 1])
        _add_term(userdata[block], userdata[block + 2 : end], time, bodies)
        block = end


def passive_callback(model_at: ModelOffsets, data_at: DataOffsets, version: int) -> Any:
    """Return the native ``mjcb_passive`` for structs with these offsets.

    The offsets and the ``version`` of the terms are compiled in, and so are part of the key of
    numba's cache, which by itself notices changes of this file only: another MuJoCo version, or a
    change of a term, gets machine code of its own.
    """
    model_words, data_words = max(model_at) + 1, max(data_at) + 1

    @cfunc(types.void(types.voidptr, types.voidptr), cache=True, error_model="numpy")
    def passive(model: Any, data: Any) -> None:
        m = carray(model, (model_words,), np.int64)
        d = carray(data, (data_words,), np.int64)
        nv, nbody = m[model_at.nv], m[model_at.nbody]
        userdata = floats(d, data_at.userdata, (m[model_at.nuserdata],))
        if userdata.size < HEADER or userdata[0] != MAGIC or userdata[1] != nv or not version:
            return
        bodies = Bodies(
            int(userdata[2]),
            ints(m, model_at.body_rootid, nbody),
            ints(m, model_at.body_weldid, nbody),
            ints(m, model_at.body_dofnum, nbody),
            ints(m, model_at.body_dofadr, nbody),
            floats(m, model_at.body_mass, (nbody,)),
            floats(m, model_at.body_inertia, (nbody, 3)),
            ints(m, model_at.dof_parentid, nv),
            floats(d, data_at.qpos, (m[model_at.nq],)),
            floats(d, data_at.qvel, (nv,)),
            floats(d, data_at.xipos, (nbody, 3)),
            floats(d, data_at.ximat, (nbody, 9)),
            floats(d, data_at.subtree_com, (nbody, 3)),
            floats(d, data_at.cdof, (nv, 6)),
            floats(d, data_at.qfrc_passive, (nv,)),
        )
        # mjData.time accumulates round-off; every integrator's stages lie on half steps
        half = 0.5 * carray(model, (model_words,), np.float64)[model_at.opt_timestep]
        time = carray(data, (data_words,), np.float64)[data_at.time]
        add_forces(userdata, half * np.rint(time / half), bodies)

    return passive


def sensor_callback(model_at: ModelOffsets, data_at: DataOffsets) -> Any:
    """Return the native ``mjcb_sensor`` that gives the bus's sensor the total on the vehicle.

    The bus's six passive forces are a force and a torque about its origin. The torque is moved to
    the centre of mass of all that moves with it: about a point that it does not turn around, as
    the bus of a vehicle whose boom grows, a force through the centre of mass would seem to turn it.
    """
    model_words, data_words = max(model_at) + 1, max(data_at) + 1

    @cfunc(types.void(types.voidptr, types.voidptr, types.int32), cache=True, error_model="numpy")
    def sensor(model: Any, data: Any, stage: int) -> None:
        m = carray(model, (model_words,), np.int64)
        d = carray(data, (data_words,), np.int64)
        nv = m[model_at.nv]
        userdata = floats(d, data_at.userdata, (m[model_at.nuserdata],))
        if userdata.size < HEADER or userdata[0] != MAGIC or userdata[1] != nv:
            return
        dof, address = int(userdata[2]), int(userdata[3])
        if stage >= _STAGE_VELOCITY and address >= 0:
            forces = floats(d, data_at.qfrc_passive, (nv,))
            readings = floats(d, data_at.sensordata, (address + 6,))
            axes = floats(d, data_at.cdof, (nv, 6))
            for i in range(3):
                readings[address + i] = forces[dof + i]
                # about axis i through the bus's origin, the centre of mass moves by s[3:]
                s = axes[dof + 3 + i]
                moved = s[3] * forces[dof] + s[4] * forces[dof + 1] + s[5] * forces[dof + 2]
                readings[address + 3 + i] = forces[dof + 3 + i] - moved

    return sensor
