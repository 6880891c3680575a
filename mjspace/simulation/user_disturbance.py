"""A disturbance of the user's own, in Python: evaluated once a step and held over it."""

from typing import Any, ClassVar, Self

import numpy as np

from mjspace.contract import Array, Truth
from mjspace.errors import FlightError, failure
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.user_code import read_only
from mjspace.vehicle.step_effect import Instant, State, StepEffect


class UserDisturbance(StepEffect):
    """A force and torque on the bus, constant over an integration step: first order only."""

    name: ClassVar[str] = "the disturbance"
    every_step: ClassVar[bool] = True
    needs_truth: ClassVar[bool] = True

    @classmethod
    def of(cls, assembly: Assembly, layout: StateLayout) -> Self | None:
        """Return the scenario's disturbance in Python; None where it has none."""
        return None if assembly.disturbance is None else cls(assembly, layout)

    def __init__(self, assembly: Assembly, layout: StateLayout) -> None:
        """Keep the disturbance, and the layout for its surroundings."""
        self._disturbance: Any = assembly.disturbance
        self._layout = layout

    def before_step(self, memory: State, instant: Instant) -> State:
        """Evaluate the disturbance at ``instant`` for the step that begins.

        Raises:
            FlightError: the disturbance raised, or returned anything but a force and a torque.
        """
        known = read_only(self._layout.with_surroundings(instant.physics, instant.truth))
        self.wrench = np.array([self._of_one(instant.time, one) for one in map(Truth, *known)])
        return memory

    def _of_one(self, now: float, truth: Truth) -> Array:
        try:
            returned = self._disturbance(now, truth)
        except BaseException as error:
            raise failure("the disturbance", error) from error
        try:
            force, torque = (np.asarray(part, dtype=float) for part in returned)
        except (TypeError, ValueError):
            raise FlightError(f"the disturbance returned {returned!r}: {_RIGHT}") from None
        if force.shape != (3,) or torque.shape != (3,):
            raise FlightError(
                f"the disturbance returned arrays of the shapes {force.shape} and {torque.shape}: "
                f"{_RIGHT}"
            )
        return np.concatenate([force, torque])


_RIGHT = "it must return a force [N] and a torque [N m], three numbers each"
