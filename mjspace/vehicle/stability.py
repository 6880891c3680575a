"""Stability of RK4 at a model's step, with its springs, dampers and servos linearized at rest.

The forces of joints, tendons and actuators are linearized numerically, so that coupled joints,
tendons and every kind of transmission are included.
"""

import copy
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array

LARGEST = 150
"""Largest number of degrees of freedom for which a model is linearized, for its computing time."""
_NUDGE = 1e-6  # rad, m, and per second: the errors by rounding and by curvature are both far below
_INSIDE = 2.0
"""RK4 is stable for every decaying or undamped mode whose |eigenvalue| x step is below this."""


@dataclass(frozen=True)
class Linear:
    """Generalized force = -damping qvel - stiffness (q - q0), controls at zero; each (nv, nv)."""

    inertia: Array
    damping: Array
    stiffness: Array


@dataclass(frozen=True)
class Mode:
    """The fastest growing mode of a model under RK4."""

    dof: int
    """The degree of freedom with the largest share of its kinetic energy."""
    growth: float
    """Growth factor per step."""
    step: float
    """Step below which it does not grow [s]."""


def linearized(model: Any) -> Linear | None:
    """Return the model about its initial position, at rest; None beyond ``LARGEST`` dofs."""
    if not 0 < model.nv <= LARGEST:
        return None
    free = _without_limits(model)
    data = mujoco.MjData(free)
    rest = data.qpos.copy()

    def force(shift: Array, rate: Array) -> Array:
        data.qpos[:], data.qvel[:] = rest, rate
        mujoco.mj_integratePos(free, data.qpos, shift, 1.0)
        mujoco.mj_forward(free, data)
        return np.array(data.qfrc_passive + data.qfrc_actuator)

    still = np.zeros(free.nv)
    nudges = _NUDGE * np.eye(free.nv)
    stiffness, damping = (
        np.array([force(*at(-nudge)) - force(*at(nudge)) for nudge in nudges]).T / (2.0 * _NUDGE)
        for at in (lambda nudge: (nudge, still), lambda nudge: (still, nudge))
    )
    return Linear(mass_matrix(model), damping, stiffness)


def _without_limits(model: Any) -> Any:
    """Return the model without limits of forces, which do not affect the slopes."""
    limits = "actuator_forcelimited", "jnt_actfrclimited", "tendon_actfrclimited"
    if not any(getattr(model, name).any() for name in limits):
        return model  # a copy, with its pictures, takes as long as all that follows
    free = copy.copy(model)
    for name in limits:
        getattr(free, name)[:] = 0
    return free


def growing(linear: Linear, step: float) -> Mode | None:
    """Return the mode that RK4 makes grow most at ``step`` [s]; None where all modes decay.

    Modes that are unstable themselves, at any step, are left out.
    """
    size = len(linear.inertia)
    accelerated = -np.linalg.solve(linear.inertia, np.hstack([linear.stiffness, linear.damping]))
    values, vectors = np.linalg.eig(
        np.vstack([np.hstack([np.zeros((size, size)), np.eye(size)]), accelerated])
    )
    z = step * values
    growth = np.abs(1.0 + z + z**2 / 2.0 + z**3 / 6.0 + z**4 / 24.0)
    growth[(np.abs(z) < _INSIDE) | (z.real > 1e-6 * np.abs(z))] = 0.0
    worst = int(np.argmax(growth))
    if growth[worst] <= 1.0 + 1e-9:
        return None
    # Kinetic energy of each degree of freedom in the mode
    share = np.abs(vectors[size:, worst]) ** 2 * np.diag(linear.inertia)
    return Mode(int(np.argmax(share)), float(growth[worst]), float(2.78 * step / abs(z[worst])))


def inertia_at_joints(model: Any) -> Array:
    """Return the inertia (nv,) that a torque between the two bodies of each dof's joint moves."""
    return 1.0 / np.diag(np.linalg.inv(mass_matrix(model))) if model.nv else np.zeros(0)


def mass_matrix(model: Any) -> Array:
    """Return the mass matrix (nv, nv) at the model's initial position."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    return matrix
