"""Forces from outside the vehicle, computed inside MuJoCo's stages by native callbacks (numba).

Parameters are read from ``userdata``, which is state, so that vehicles of one batch may differ:

    MAGIC, number of dofs, first dof of the bus, address of the sensor (-1: none)
    kind, length, payload...                one block for each term, to the end or to a kind 0

A model whose userdata does not start with MAGIC and its own number of dofs is left alone. To add a
term: a kind here with its packer in ``mjspace.environment``, a function of (payload, time, vehicle)
and its line in ``add_forces``. Numba's cache notices a change of this file only: after an edit of a
compiled function elsewhere that is called from here, touch this file.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import cfunc, njit, types
from numba.np.numpy_support import carray

from mjspace.environment import kepler
from mjspace.environment.native_memory import floats, ints
from mjspace.environment.struct_offsets import DataOffsets, ModelOffsets
from mjspace.environment.torques import body_torque, friction, inertial_torque, magnetic, ripple

MAGIC = 6.02214076e23
HEADER = 4
ORBIT, BODY_TORQUE, INERTIAL_TORQUE, FRICTION, RIPPLE, GRAVITY = 1.0, 2.0, 3.0, 8.0, 5.0, 6.0
MAGNETIC = 7.0  # the first block where there is one, so that it is known where it stands:
FIELD = slice(HEADER + 2, HEADER + 15)
MOMENT = slice(HEADER + 15, HEADER + 18)

_STAGE_VELOCITY = 2  # mjSTAGE_VEL: passive forces are known from it on


class Vehicle(NamedTuple):
    """What the terms read, under MuJoCo's names, and ``qfrc_passive``, which they add to.

    ``bus_dof`` is the first of the bus's six: force in world axes, then torque in body axes.
    """

    bus_dof: Any
    body_rootid: Any
    body_weldid: Any
    body_dofnum: Any
    body_dofadr: Any
    body_mass: Any
    body_inertia: Any
    dof_parentid: Any
    qpos: Any
    qvel: Any
    xipos: Any
    ximat: Any
    subtree_com: Any
    cdof: Any
    qfrc_passive: Any


@njit(cache=True, error_model="numpy")
def add_forces(userdata: Any, time: float, vehicle: Vehicle) -> None:
    """Add every term that ``userdata`` holds, at ``time`` [s], to ``qfrc_passive``."""
    block = HEADER
    while block + 2 <= userdata.size and userdata[block] != 0.0:
        kind, end = userdata[block], block + 2 + int(userdata[block + 1])
        payload = userdata[block + 2 : end]
        if kind == ORBIT:
            tidal(payload, time, vehicle)
        elif kind == BODY_TORQUE:
            body_torque(payload, time, vehicle)
        elif kind == INERTIAL_TORQUE:
            inertial_torque(payload, time, vehicle)
        elif kind == FRICTION:
            friction(payload, vehicle)
        elif kind == RIPPLE:
            ripple(payload, vehicle)
        elif kind == GRAVITY:
            central(payload, vehicle)
        elif kind == MAGNETIC:
            magnetic(payload, time, vehicle)
        block = end


@njit(cache=True, error_model="numpy")
def tidal(orbit: Any, time: float, vehicle: Vehicle) -> None:
    """Add the planet's gravity less that at the frame's origin, which falls along ``orbit``.

    Every body feels it at its own centre of mass, and 3 GM/r^3 u x I u, the gravity-gradient torque
    of its own inertia there, u the unit vector from the planet (Wertz 1978, Spacecraft Attitude
    Determination and Control, section 17.2.1). The difference is Encke's, without cancellation
    (Battin 1999, Mathematics and Methods of Astrodynamics, chapter 8).
    """
    rx, ry, rz = kepler.position(orbit, time)
    radius2 = rx * rx + ry * ry + rz * rz
    rate2 = orbit[0] / (radius2 * math.sqrt(radius2))
    for body in range(1, vehicle.body_mass.size):
        mass = vehicle.body_mass[body]
        if mass == 0.0:
            continue
        dx, dy, dz = vehicle.xipos[body]
        x, y, z = rx + dx, ry + dy, rz + dz
        # |R + d|^2 = (1 + q) |R|^2;  shrink = (1 + q)^(-3/2) - 1
        q = (dx * (dx + 2.0 * rx) + dy * (dy + 2.0 * ry) + dz * (dz + 2.0 * rz)) / radius2
        ratio3 = (1.0 + q) * math.sqrt(1.0 + q)
        shrink = -q * (3.0 + q * (3.0 + q)) / (ratio3 * (1.0 + ratio3))
        scale = -mass * rate2
        force = (scale * (dx + shrink * x), scale * (dy + shrink * y), scale * (dz + shrink * z))
        factor = 3.0 * rate2 / (ratio3 * (1.0 + q) * radius2)
        add_wrench(vehicle, body, force, gradient_torque(vehicle, body, x, y, z, factor))


@njit(cache=True, error_model="numpy")
def central(gravity: Any, vehicle: Vehicle) -> None:
    """Add a planet's gravity on every body at its own place, with its gradient's torque.

    ``gravity``: the gravitational parameter [m^3/s^2], the origin's distance from the centre [m],
    from which it is along z.
    """
    for body in range(1, vehicle.body_mass.size):
        mass = vehicle.body_mass[body]
        if mass == 0.0:
            continue
        x, y, z = vehicle.xipos[body]
        z += gravity[1]
        radius2 = x * x + y * y + z * z
        rate2 = gravity[0] / (radius2 * math.sqrt(radius2))
        scale = -mass * rate2
        force = (scale * x, scale * y, scale * z)
        torque = gradient_torque(vehicle, body, x, y, z, 3.0 * rate2 / radius2)
        add_wrench(vehicle, body, force, torque)


@njit(cache=True, error_model="numpy")
def gradient_torque(
    vehicle: Vehicle, body: int, x: float, y: float, z: float, factor: float
) -> tuple[float, float, float]:
    """Return ``factor`` r x I r [N m], world axes, of ``body`` at r = (x, y, z) from the planet."""
    # the columns of ximat are the principal axes
    m, inertia = vehicle.ximat[body], vehicle.body_inertia[body]
    a = m[0] * x + m[3] * y + m[6] * z
    b = m[1] * x + m[4] * y + m[7] * z
    c = m[2] * x + m[5] * y + m[8] * z
    ta = factor * (inertia[2] - inertia[1]) * b * c
    tb = factor * (inertia[0] - inertia[2]) * c * a
    tc = factor * (inertia[1] - inertia[0]) * a * b
    return (
        m[0] * ta + m[1] * tb + m[2] * tc,
        m[3] * ta + m[4] * tb + m[5] * tc,
        m[6] * ta + m[7] * tb + m[8] * tc,
    )


@njit(cache=True, error_model="numpy")
def add_wrench(vehicle: Vehicle, body: int, force: Any, torque: Any) -> None:
    """Add a force [N] at ``body``'s centre of mass and a torque [N m], both in world axes.

    Each dof that moves the body takes its share through ``cdof``, its axis of motion (rotation,
    translation) referred to the centre of mass of the body's tree.
    """
    place, center = vehicle.xipos[body], vehicle.subtree_com[vehicle.body_rootid[body]]
    x, y, z = place[0] - center[0], place[1] - center[1], place[2] - center[2]
    mx = torque[0] + y * force[2] - z * force[1]
    my = torque[1] + z * force[0] - x * force[2]
    mz = torque[2] + x * force[1] - y * force[0]
    weld = vehicle.body_weldid[body]
    dof = vehicle.body_dofadr[weld] + vehicle.body_dofnum[weld] - 1  # negative: nothing moves it
    while dof >= 0:
        s = vehicle.cdof[dof]
        turn = s[0] * mx + s[1] * my + s[2] * mz
        vehicle.qfrc_passive[dof] += turn + s[3] * force[0] + s[4] * force[1] + s[5] * force[2]
        dof = vehicle.dof_parentid[dof]


def passive_callback(model_at: ModelOffsets, data_at: DataOffsets) -> Any:
    """Return the native ``mjcb_passive`` for structs with these offsets.

    The offsets are compiled in, and with them part of the key of numba's cache: another MuJoCo
    version gets machine code of its own.
    """
    model_words, data_words = max(model_at) + 1, max(data_at) + 1

    @cfunc(types.void(types.voidptr, types.voidptr), cache=True, error_model="numpy")
    def passive(model: Any, data: Any) -> None:
        m = carray(model, (model_words,), np.int64)
        d = carray(data, (data_words,), np.int64)
        nv, nbody = m[model_at.nv], m[model_at.nbody]
        userdata = floats(d, data_at.userdata, (m[model_at.nuserdata],))
        if userdata.size < HEADER or userdata[0] != MAGIC or userdata[1] != nv:
            return
        vehicle = Vehicle(
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
        add_forces(userdata, half * np.rint(time / half), vehicle)

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
