"""The order of convergence that any model shows of itself, and the step that it needs."""

import copy
import math
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.validation import stand
from mjspace.validation.benchmark import Conditions

PROBE = 10.0
"""How long a flight is watched, at the most [s]."""
Convergence = list[tuple[float, float]]
"""Steps [s], each half of the one before, and how fast the attitude, or a fixed base's joints, go
wrong at each, seen from half of it [rad/s]."""
_FINE, _COARSE = 1e-9, 1e-3  # rad/s: errors between which convergence is watched
_ROUNDING = 1e-13  # rad/s: errors that no step makes smaller


def observe(model: Any, start: Any) -> Convergence:
    """Halve the step from a coarse one on, until the error is small or the step a fourth of ours.

    So a stiff or a slow model is each probed where its error can be seen, and at little cost.
    """
    halvings = max(2, math.floor(math.log2(PROBE / model.opt.timestep)))
    step = model.opt.timestep * 2.0 ** (halvings - 2)
    duration, finest = 4.0 * step, model.opt.timestep / 4.0
    found: Convergence = []
    before = _end(model, start, duration, step)
    while step > finest and not (len(found) >= 3 and found[-1][1] < _FINE):
        after = _end(model, start, duration, step / 2.0)
        error = _apart(model, before, after) / duration
        found = [*found, (step, error)] if error < _COARSE else []
        step, before = step / 2.0, after
    return found


def slope(found: Convergence) -> float:
    """Return the observed order: the slope of log error over log step at the finest three.

    NaN where less than two errors can be told from rounding.
    """
    seen = [pair for pair in found if pair[1] > _ROUNDING][-3:]
    if len(seen) < 2:
        return math.nan
    steps, errors = np.log(seen).T
    return float(np.polyfit(steps, errors, 1)[0])


def step_for(found: Convergence, goal: float, duration: float) -> float:
    """Return the step [s] that errs by ``goal`` [rad] in ``duration`` [s], as far as is known.

    No step longer than the coarsest that was seen to do.
    """
    order, (step, error), coarsest = slope(found), found[-1], found[0][0]
    if math.isnan(order):
        return coarsest
    in_all = error * duration / (1.0 - 2.0**-order)  # half the step has an error of its own
    return float(min(step * (goal / in_all) ** (1.0 / order), coarsest))


def _end(model: Any, start: Any, duration: float, step: float) -> Array:
    flyer = copy.copy(model)
    flyer.opt.timestep = step
    final: Array = stand.fly(Conditions(step), flyer, copy.copy(start), duration).qpos[-1]
    return final


def _apart(model: Any, one: Array, other: Array) -> float:
    """Return the largest angle [rad] between two attitudes; of a fixed base, between its joints."""
    difference = np.zeros(model.nv)
    mujoco.mj_differentiatePos(model, difference, 1.0, one, other)
    free = model.jnt_dofadr[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]
    seen = (
        np.ravel([range(dof + 3, dof + 6) for dof in free]).astype(int)
        if free.size
        else slice(0, None)
    )
    return float(np.abs(difference[seen]).max())
