"""Propellant that burns: bodies lose mass and inertia from one integration step to the next."""

from typing import Any, ClassVar, Self

import numpy as np

from mjspace.actuators.actuator_set import ActuatorSet
from mjspace.contract import Array
from mjspace.vehicle.step_effect import Instant, State, StepEffect


class BurningMass(StepEffect):
    """Gives bodies the masses that actuators' propellant has in the middle of each step.

    At a control instant they have those of the instant, for what is observed then.
    """

    name: ClassVar[str] = "the burning mass"
    every_step: ClassVar[bool] = True
    not_compiled = ""

    @classmethod
    def of(cls, actuators: ActuatorSet) -> Self | None:
        """Return the effect for ``actuators``; None where none of them burns anything."""
        state = actuators.reset(1)
        return cls(actuators) if actuators.masses(state, state) else None

    def __init__(self, actuators: ActuatorSet) -> None:
        """Keep the ``actuators`` that know what burns."""
        self._actuators = actuators
        self._batch: Any = None

    def bind(self, batch: Any) -> None:
        """Take the batch whose model's fields change."""
        self._batch = batch

    def weigh(self, memory: State) -> None:
        """Set the masses of a control instant."""
        self._set(memory, memory)

    def before_step(self, memory: State, instant: Instant) -> State:
        """Set the masses of the middle of the step."""
        self._set(instant.memory, memory)
        return memory

    def _set(self, before: State, after: State) -> None:
        """Set masses and inertias.

        The constants that MuJoCo derives from them take 0.6 of a step's time: they are derived
        again only where something burns.
        """
        changes = self.masses(before, after)
        fields = [(self._batch.expand(name)[:, body], values) for name, body, values in changes]
        if any(not np.array_equal(field, values) for field, values in fields):
            for field, values in fields:
                field[:] = values
            self._batch.set_const()

    def masses(self, before: State, after: State) -> list[tuple[str, int, Array]]:
        """Return the masses and inertias in the middle of the step from ``before`` to ``after``."""
        return self._actuators.masses(before, after)
