"""The lander's laws on what a filter believes, in place of what is true: paper 003's future work.

Position, velocity and attitude are read once, at the start: the last fix before the descent.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, Trajectory

from . import lander, lander_vectoring
from .lander_filter import Belief, Navigation


class Shown(NamedTuple):
    """What is shown besides the law's own signals."""

    believed_position: Array
    """World axes [m], (..., 3)."""
    believed_velocity: Array
    """World axes [m/s], (..., 3)."""
    believed_attitude: Array
    """Quaternion, body to world, (..., 4)."""
    sigma: Array
    """Standard deviations of position, velocity and attitude (body axes), SI, (..., 9)."""


def _joined(name: str, *parts: Any) -> Any:
    """Return a named tuple that has the fields of all ``parts``."""
    return NamedTuple(name, [(f, part.__annotations__[f]) for part in parts for f in part._fields])


StructureState = _joined("StructureState", lander.State, Belief)
StructureSignals = _joined("StructureSignals", lander.Signals, Shown)
VectoringState = _joined("VectoringState", lander_vectoring.State, Belief)
VectoringSignals = _joined("VectoringSignals", lander_vectoring.Signals, Shown)


@dataclass(frozen=True, kw_only=True)
class EstimatedStructure(lander.VariableStructure, Navigation):
    """``lander.VariableStructure``, estimating."""

    def reset(self, measurement: Measurement, reference: Trajectory) -> Any:
        """Return the law's state, and the belief at the fix."""
        return StructureState(*super().reset(measurement, reference), *self.fix(measurement))

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Trajectory
    ) -> tuple[Any, Any, Any]:
        """Return the state, the command, and the law's signals with what is believed."""
        belief, seen = _believing(self, state, measurement)
        own = lander.State(*state[: -len(Belief._fields)])
        after, command, signals = super().step(own, time, seen, reference)
        shown = StructureSignals(*signals, *_shown(belief))
        return StructureState(*after, *belief), command, shown


@dataclass(frozen=True, kw_only=True)
class EstimatedVectoring(lander_vectoring.ThrustVectoring, Navigation):
    """``lander_vectoring.ThrustVectoring``, estimating."""

    def reset(self, measurement: Measurement, reference: Trajectory) -> Any:
        """Return the law's state, and the belief at the fix."""
        return VectoringState(*super().reset(measurement, reference), *self.fix(measurement))

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Trajectory
    ) -> tuple[Any, Any, Any]:
        """Return the state, the command, and the law's signals with what is believed."""
        belief, seen = _believing(self, state, measurement)
        own = lander_vectoring.State(*state[: -len(Belief._fields)])
        after, command, signals = super().step(own, time, seen, reference)
        shown = VectoringSignals(*signals, *_shown(belief))
        return VectoringState(*after, *belief), command, shown


def _believing(
    navigation: Navigation, state: Any, measurement: Measurement
) -> tuple[Belief, Measurement]:
    belief = navigation.navigate(Belief(*state[-len(Belief._fields) :]), measurement)
    return belief, navigation.believed(belief, measurement)


def _shown(belief: Belief) -> Shown:
    variance = np.diagonal(belief.covariance, axis1=-2, axis2=-1)[..., :9]
    return Shown(*belief[:3], np.sqrt(variance))
