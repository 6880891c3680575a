"""Torque ripple of the motors that turn hinges."""

import math
from typing import Annotated, Any, ClassVar, Self

import numpy as np

from mjspace.contract import Array
from mjspace.environment.base import Term
from mjspace.environment.bodies import Bodies
from mjspace.environment.compiled import compiled
from mjspace.environment.joints import hinge
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import NonNegative, Si, Table, WithinTurn
from mjspace.scenario.plant import PlantTable


@compiled
def ripple(hinges: Any, time: float, bodies: Bodies) -> None:
    """Add amplitude cos(cycles angle + phase) [N m] to hinges; their reaction is what carries them.

    Five numbers for each: dof, place in ``qpos``, amplitude, cycles a turn, phase [rad]. J. Servín
    Aguilar, Control de orientacion para satelites con compensacion de vibracion, UNAM 2022, (4.3).
    """
    for i in range(0, hinges.size, 5):
        angle = bodies.qpos[int(hinges[i + 1])]
        torque = hinges[i + 2] * math.cos(hinges[i + 3] * angle + hinges[i + 4])
        bodies.qfrc_passive[int(hinges[i])] += torque


class Ripple(Table):
    """A motor's torque ripple: amplitude cos(cycles angle + phase) on its hinge, with reaction."""

    amplitude: Annotated[NonNegative, Si("N m")]
    """Largest torque."""
    cycles: NonNegative
    """In a turn of the hinge; a fraction makes a ripple slower than the turn."""
    phase: WithinTurn = 0.0
    """At angle zero."""


class TorqueRipple(Term):
    """The ripple of every motor that has some, by the name of its hinge."""

    kernels: ClassVar = {5: ripple}

    ripples: dict[str, Ripple]

    @classmethod
    def of(cls, plant: PlantTable) -> list[Self]:
        """Return the plant's ripple; nothing where there is none."""
        return [cls(ripples=plant.ripple)] if plant.ripple else []

    def payload_size(self, environment: Environment) -> int:
        """Return five numbers for each hinge."""
        return 5 * len(self.ripples)

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return dof, place in ``qpos``, amplitude, cycles a turn and phase of each."""
        rows = [(*hinge(model, k), r.amplitude, r.cycles, r.phase) for k, r in self.ripples.items()]
        return np.ravel(rows)
