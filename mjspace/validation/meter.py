"""Momentum and energy of a recorded flight, summed body by body.

Our own sums, not MuJoCo's sensors: armature, which moves nothing that one can see, is in none of
them, and nothing is stale.
"""

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.validation.stand import Record


def angular_momentum(record: Record) -> Array:
    """Return the total angular momentum about the centre of mass [N m s], world axes, (n, 3)."""
    return np.array([_sums(record.model, data)[1] for data in _states(record)])


def linear_momentum(record: Record) -> Array:
    """Return the total linear momentum [N s], world axes, shape (n, 3)."""
    return np.array([_sums(record.model, data)[0] for data in _states(record)])


def kinetic_energy(record: Record) -> Array:
    """Return the kinetic energy [J], shape (n,)."""
    return np.array([_sums(record.model, data)[2] for data in _states(record)])


def potential_energy(record: Record) -> Array:
    """Return the energy of springs and of uniform gravity [J], shape (n,)."""
    energies = []
    for data in _states(record):
        mujoco.mj_energyPos(record.model, data)
        energies.append(data.energy[0])
    return np.array(energies)


def centre_of_mass(record: Record) -> Array:
    """Return where the moving bodies' centre of mass is [m], world axes, shape (n, 3)."""
    moving = record.model.body_weldid != 0
    mass = record.model.body_mass[moving]
    return np.array([mass @ data.xipos[moving] / mass.sum() for data in _states(record)])


def drift(values: Array, scale: float | None = None) -> float:
    """Return the largest departure of the rows from the first, over ``scale`` in their unit.

    ``scale`` is the first row's size when left out; give the bus's part where a fast wheel has most
    of it.
    """
    rows = values.reshape(len(values), -1)
    size = np.linalg.norm(rows[0]) if scale is None else scale
    return float(np.linalg.norm(rows - rows[0], axis=1).max() / size)


def _states(record: Record) -> Iterator[Any]:
    """Yield MuJoCo's data for every row, positions and velocities worked out."""
    data = mujoco.MjData(record.model)
    for qpos, qvel in zip(record.qpos, record.qvel, strict=True):
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_kinematics(record.model, data)
        mujoco.mj_comPos(record.model, data)
        mujoco.mj_fwdVelocity(record.model, data)
        yield data


def _sums(model: Any, data: Any) -> tuple[Array, Array, float]:
    """Return linear momentum, angular momentum about the centre of mass, and kinetic energy."""
    moving = np.flatnonzero(model.body_weldid)
    mass, place, velocity = model.body_mass[moving], data.xipos[moving], np.zeros((moving.size, 3))
    spin, own, energy = np.zeros(6), np.zeros(3), 0.0
    for index, body in enumerate(moving):
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, spin, 0)
        principal = data.ximat[body].reshape(3, 3)
        momentum = principal @ (model.body_inertia[body] * (principal.T @ spin[:3]))
        velocity[index] = spin[3:]
        own += momentum
        energy += 0.5 * (spin[:3] @ momentum + mass[index] * spin[3:] @ spin[3:])
    linear = mass @ velocity
    centre = mass @ place / mass.sum()
    mean = linear / mass.sum()
    orbital = np.sum(mass[:, None] * np.cross(place - centre, velocity - mean), axis=0)
    return linear, own + orbital, float(energy)
