"""The states of a linear plant: their names and units, and the kinematics between them."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mjspace.algebra import cross_matrix
from mjspace.contract import Array
from mjspace.vehicle.vehicle import Vehicle

_KIND = mujoco.mjtJoint
_FREE, _BALL, _SLIDE = map(int, (_KIND.mjJNT_FREE, _KIND.mjJNT_BALL, _KIND.mjJNT_SLIDE))


class _Named(NamedTuple):
    """A degree of freedom: the names of its coordinate and of its rate, "" for one left out."""

    place: str
    speed: str
    unit: str
    """Of the coordinate."""


def states_of(vehicle: Vehicle) -> Iterator[tuple[str, str]]:
    """Yield name and unit of each coordinate, of each rate, and of each activation of a motor.

    They are in the order of MuJoCo's ``qvel``, twice, and ``act``. The name is "" for an angle that
    is left out: a wheel's that is not measured, on which nothing depends but imbalance.
    """
    model = vehicle.model
    named = [each for joint in range(model.njnt) for each in _freedoms(vehicle, joint)]
    yield from ((each.place, each.unit) for each in named)
    yield from ((each.speed, f"{each.unit}/s") for each in named)
    for motor in range(model.nu):
        count, name = int(model.actuator_actnum[motor]), model.actuator(motor).name
        yield from (
            (f"{name}.activation[{i}]" if count > 1 else f"{name}.activation", "")
            for i in range(count)
        )


def kinematics(model: Any, qvel: Array, states: int) -> Array:
    """Return the rows of A, (nv, ``states``), of the coordinates at rates ``qvel`` (nv,).

    A coordinate's derivative is its rate, and of the attitude of a free or a ball joint
    attitude' = rate - w x attitude, w (3,) the joint's rate.
    """
    rows = np.eye(model.nv, states, model.nv)
    for joint in range(model.njnt):
        kind, first = model.jnt_type[joint], int(model.jnt_dofadr[joint])
        if kind in (_FREE, _BALL):
            first += 3 * int(kind == _FREE)  # after the position
            turns = slice(first, first + 3)
            rows[turns, turns] = -cross_matrix(qvel[turns])
    return rows


def _freedoms(vehicle: Vehicle, joint: int) -> list[_Named]:
    """Return the degrees of freedom of a joint; those of the bus have plain names."""
    model, kind = vehicle.model, vehicle.model.jnt_type[joint]
    body = model.body(int(model.jnt_bodyid[joint])).name
    name = model.joint(joint).name or body
    axes = range(3)
    if kind == _FREE:
        of = f"{body}." if joint else ""
        moves = [_Named(f"{of}position[{i}]", f"{of}velocity[{i}]", "m") for i in axes]
        return moves + [_Named(f"{of}attitude[{i}]", f"{of}rate[{i}]", "rad") for i in axes]
    if kind == _BALL:
        return [_Named(f"{name}.attitude[{i}]", f"{name}.rate[{i}]", "rad") for i in axes]
    return [_hinge(vehicle, joint, name)]


def _hinge(vehicle: Vehicle, joint: int, name: str) -> _Named:
    """Return that of a hinge or a slide."""
    model, dof = vehicle.model, int(vehicle.model.jnt_dofadr[joint])
    unit = "m" if model.jnt_type[joint] == _SLIDE else "rad"
    wheels, gimbals = list(vehicle.wheel_dof), list(vehicle.gimbal_dof)
    if dof in wheels:
        at = f"[{wheels.index(dof)}]"
        encoded = int(model.jnt_qposadr[joint]) in vehicle.wheel_qpos
        return _Named(f"wheel_angle{at}" if encoded else "", f"wheel_speed{at}", unit)
    if dof in gimbals:
        at = f"[{gimbals.index(dof)}]"
        return _Named(f"gimbal_angle{at}", f"gimbal_rate{at}", unit)
    return _Named(f"{name}.position", f"{name}.velocity", unit)
