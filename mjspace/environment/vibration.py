"""Vibration torque on hinges that depends on time, not on their angle."""

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
def vibrate(hinges: Any, time: float, bodies: Bodies) -> None:
    """Add amplitude cos(frequency t + phase) [N m] to hinges; their reaction is what carries them.

    Four numbers for each: dof, amplitude [N m], frequency [rad/s], phase [rad]. J. Servín Aguilar,
    Control de orientacion para satelites con compensacion de vibracion, UNAM 2022, (2.75).
    """
    for i in range(0, hinges.size, 4):
        torque = hinges[i + 1] * math.cos(hinges[i + 2] * time + hinges[i + 3])
        bodies.qfrc_passive[int(hinges[i])] += torque


class Vibration(Table):
    """A torque amplitude cos(frequency t + phase) on a hinge, with reaction on what carries it."""

    amplitude: Annotated[NonNegative, Si("N m")]
    """Largest torque."""
    frequency: Annotated[NonNegative, Si("rad/s")]
    """Angular."""
    phase: WithinTurn = 0.0
    """At time zero."""


class HingeVibration(Term):
    """The vibration of every hinge that has some, by the name of the hinge."""

    kernels: ClassVar = {14: vibrate}

    vibrations: dict[str, Vibration]

    @classmethod
    def of(cls, plant: PlantTable) -> list[Self]:
        """Return the plant's vibration; nothing where there is none."""
        return [cls(vibrations=plant.vibration)] if plant.vibration else []

    def payload_size(self, environment: Environment) -> int:
        """Return four numbers for each hinge."""
        return 4 * len(self.vibrations)

    def pack(self, model: Any, environment: Environment) -> Array:
        """Return dof, amplitude, frequency and phase of each."""
        rows = [
            (hinge(model, name)[0], v.amplitude, v.frequency, v.phase)
            for name, v in self.vibrations.items()
        ]
        return np.ravel(rows)
