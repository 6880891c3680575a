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
    mass = model.body_mass[1:]
    place, velocity = data.xipos[1:], np.zeros((model.nbody - 1, 3))
    spin, own, energy = np.zeros(6), np.zeros(3), 0.0
    for body in range(1, model.nbody):
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, spin, 0)
        principal = data.ximat[body].reshape(3, 3)
        momentum = principal @ (model.body_inertia[body] * (principal.T @ spin[:3]))
        velocity[body - 1] = spin[3:]
        own += momentum
        energy += 0.5 * (spin[:3] @ momentum + mass[body - 1] * spin[3:] @ spin[3:])
    linear = mass @ velocity
    centre = mass @ place / mass.sum()
    mean = linear / mass.sum()
    orbital = np.sum(mass[:, None] * np.cross(place - centre, velocity - mean), axis=0)
    return linear, own + orbital, float(energy)
