"""Observed order of convergence of any model, and the step that it needs."""

import copy
import math
from typing import Any

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.validation import stand
from mjspace.validation.benchmark import Conditions

PROBE = 10.0
"""Longest flight for the observation of convergence [s]."""
Convergence = list[tuple[float, float]]
"""Pairs of a step [s], each half of the one before, and its error rate [rad/s]: the difference to
half the step over the duration, of the attitude or, on a fixed base, of the joints."""
_FINE, _COARSE = 1e-9, 1e-3  # rad/s: range of error rates in which convergence is observed
_ROUNDING = 1e-13  # rad/s: error rate due to rounding


def observe(model: Any, start: Any) -> Convergence:
    """Halve the step from a coarse one until the error is small or the step a quarter of the
    model's.

    Stiff and slow models are both observed where their error is measurable, at little cost.
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
    """Return the observed order: the slope of log error over log step at the three finest steps.

    NaN where fewer than two errors are above rounding.
    """
    usable = [pair for pair in found if pair[1] > _ROUNDING][-3:]
    if len(usable) < 2:
        return math.nan
    steps, errors = np.log(usable).T
    return float(np.polyfit(steps, errors, 1)[0])


def step_for(found: Convergence, goal: float, duration: float) -> float:
    """Return the step [s] with an extrapolated error of ``goal`` [rad] in ``duration`` [s].

    It is at most the coarsest observed step.
    """
    order, (step, error), coarsest = slope(found), found[-1], found[0][0]
    if math.isnan(order):
        return coarsest
    total = error * duration / (1.0 - 2.0**-order)  # includes the error of half the step
    return float(min(step * (goal / total) ** (1.0 / order), coarsest))


def _end(model: Any, start: Any, duration: float, step: float) -> Array:
    flyer = copy.copy(model)
    flyer.opt.timestep = step
    final: Array = stand.fly(Conditions(step), flyer, copy.copy(start), duration).qpos[-1]
    return final


def _apart(model: Any, one: Array, other: Array) -> float:
    """Return the largest angle [rad] between two attitudes or, on a fixed base, between joints."""
    difference = np.zeros(model.nv)
    mujoco.mj_differentiatePos(model, difference, 1.0, one, other)
    free = model.jnt_dofadr[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]
    compared = (
        np.ravel([range(dof + 3, dof + 6) for dof in free]).astype(int)
        if free.size
        else slice(0, None)
    )
    return float(np.abs(difference[compared]).max())
