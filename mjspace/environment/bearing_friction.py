"""Dry friction of bearings, smoothed so that it comes to rest with any integration step."""

import math
import warnings
from collections.abc import Sequence
from typing import Any, ClassVar, Self

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.environment.base import Term
from mjspace.environment.bodies import Bodies
from mjspace.environment.compiled import compiled
from mjspace.environment.joints import hinge
from mjspace.scenario.environment import Environment
from mjspace.scenario.hinges import Friction
from mjspace.scenario.plant import PlantTable
from mjspace.vehicle.model_checks import ModelWarning
from mjspace.vehicle.stability import mass_matrix

SPEED = 0.1
"""Speed [rad/s] over which friction is smoothed through zero, where the step is short enough."""
OF_STRIBECK = 1.0 / 30.0
"""The same as a part of the Stribeck speed, where that is less: 98.5 % of the breakaway acts."""
_RK4, _OTHERS = 0.72 * 2.785, 0.5 * 2.0
"""Slope times step over inertia: of what the integrator damps at all, that part which leaves room
for an inertia that changes with the configuration and, with Euler, does not overshoot."""
_LEAST = 0.1
"""The least that is left where viscous friction leaves no room."""


@compiled
def friction(hinges: Any, time: float, bodies: Bodies) -> None:
    """Add dry friction [N m] to hinges, as ``BearingFriction.pack`` packs it."""
    for i in range(0, hinges.size, 5):
        dof, torque = int(hinges[i]), hinges[i + 1]
        speed = bodies.qvel[dof]
        if hinges[i + 2] > 0.0:
            torque += hinges[i + 2] * math.exp(-((speed / hinges[i + 3]) ** 2))
        bodies.qfrc_passive[dof] -= torque * math.tanh(speed / hinges[i + 4])


class BearingFriction(Term):
    """The dry friction of every hinge that has some, by its name."""

    kernels: ClassVar = {8: friction}

    frictions: dict[str, Friction]

    @classmethod
    def of(cls, plant: PlantTable) -> list[Self]:
        """Return the dry friction of the plant's wheels and hinges; nothing where there is none."""
        rough = {name: f for name, hinge in plant.hinges.items() if (f := hinge.friction)}
        for fitted in plant.equipment.values():
            rough = fitted.dry_friction() | rough
        return [cls(frictions=rough)] if rough else []

    def payload_size(self, environment: Environment) -> int:
        """Return five numbers for each hinge."""
        return 5 * len(self.frictions)

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return dof, c, b - c, Stribeck's speed and the smoothing speed of each.

        Warns:
            ModelWarning: the step is so long that the breakaway friction is smoothed away.
        """
        rows = []
        dofs = [hinge(model, name)[0] for name in self.frictions]
        speeds = smoothing(model, list(self.frictions.values()), dofs)
        for (name, friction), dof, speed in zip(self.frictions.items(), dofs, speeds, strict=True):
            excess, stribeck = friction.steepest - friction.coulomb, friction.stribeck_speed or 1.0
            if excess > 0.0 and speed > 3.0 * OF_STRIBECK * stribeck:
                step = model.opt.timestep * 3.0 * OF_STRIBECK * stribeck / speed
                warnings.warn(
                    f"hinge {name!r}: a step of {model.opt.timestep:g} s smooths its friction over "
                    f"{speed:.3g} rad/s, too wide for a stribeck_speed of {stribeck:g} rad/s: "
                    f"under 93 % of its breakaway_friction acts; take a step below {step:.2g} s",
                    ModelWarning,
                    stacklevel=2,
                )
            rows.append([dof, friction.coulomb, excess, stribeck, speed])
        return np.ravel(rows)


def smoothing(model: Any, frictions: Sequence[Friction], dofs: Sequence[int]) -> Array:
    """Return the speed [rad/s] over which each hinge's friction is smoothed through zero.

    It is wide enough for the integrator to bring every hinge to rest: the slopes D of all of them
    obey h max_i sum_j |M^-1_ij| D_j < the integrator's limit (Gershgorin), M the mass matrix.
    """
    where = np.array(dofs, dtype=int)
    mobility = np.abs(np.linalg.inv(mass_matrix(model))[np.ix_(where, where)]).sum(axis=0)
    gained = model.opt.timestep * mobility  # rad/s in a step for each N m
    limit = np.full(len(where), _OTHERS)  # which treat viscous friction implicitly
    if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        limit = np.maximum(_RK4 - gained * model.dof_damping[where], _LEAST)
    narrowest = [
        min(SPEED, np.inf if f.breakaway is None else OF_STRIBECK * (f.stribeck_speed or 1.0))
        for f in frictions
    ]
    steepest = np.array([friction.steepest for friction in frictions])
    widths: Array = np.maximum(narrowest, gained * steepest / limit)
    return widths
