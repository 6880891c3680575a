"""The lander's laws on the estimates of a navigation filter: future work of paper 003.

Measured position, velocity and attitude are read once, as the last fix before the descent.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement

from . import lander, lander_vectoring, powered_descent
from .lander_filter import FilterState, Navigation


class Estimates(NamedTuple):
    """The filter's signals, logged beside those of the law."""

    estimated_position: Array
    """World axes [m], (..., 3)."""
    estimated_velocity: Array
    """World axes [m/s], (..., 3)."""
    estimated_attitude: Array
    """Quaternion, body to world, (..., 4)."""
    sigma: Array
    """Estimated standard deviations of position [m] and velocity [m/s], world axes, and of the
    attitude [rad], body axes, (..., 9)."""


def _joined(name: str, *parts: Any) -> Any:
    """Return a named tuple type with the fields of all ``parts``."""
    return NamedTuple(name, [(f, part.__annotations__[f]) for part in parts for f in part._fields])


StructureState = _joined("StructureState", lander.State, FilterState)
StructureSignals = _joined("StructureSignals", lander.Signals, Estimates)
VectoringState = _joined("VectoringState", lander_vectoring.State, FilterState)
VectoringSignals = _joined("VectoringSignals", lander_vectoring.Signals, Estimates)
DescentState = _joined("DescentState", powered_descent.State, FilterState)
DescentSignals = _joined("DescentSignals", powered_descent.Signals, Estimates)


class _OnEstimates:
    """The filter of ``Navigation`` before a law: both are bases beside this one, the law first."""

    kinds: ClassVar[tuple[Any, Any, Any]]
    """Of the law's state, and of state and signals with those of the filter."""

    def reset(self, measurement: Measurement, reference: Any) -> Any:
        """Return the law's initial state and the initial estimates."""
        this: Any = self
        own: Any = super()
        return self.kinds[1](*own.reset(measurement, reference), *this.fix(measurement))

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Any
    ) -> tuple[Any, Any, Any]:
        """Return the next state, the command, and the signals of law and filter."""
        this: Any = self
        of_law, joined_state, joined_signals = self.kinds
        first = len(state) - len(FilterState._fields)
        estimate: FilterState = this.navigate(FilterState(*state[first:]), measurement)
        seen = this.estimated(estimate, measurement)
        own: Any = super()
        after, command, signals = own.step(of_law(*state[:first]), time, seen, reference)
        variance = np.diagonal(estimate.covariance, axis1=-2, axis2=-1)[..., :9]
        estimates = Estimates(*estimate[:3], np.sqrt(variance))
        return joined_state(*after, *estimate), command, joined_signals(*signals, *estimates)


@dataclass(frozen=True, kw_only=True)
class EstimatedStructure(_OnEstimates, lander.VariableStructure, Navigation):
    """``lander.VariableStructure`` on estimates."""

    kinds = lander.State, StructureState, StructureSignals


@dataclass(frozen=True, kw_only=True)
class EstimatedVectoring(_OnEstimates, lander_vectoring.ThrustVectoring, Navigation):
    """``lander_vectoring.ThrustVectoring`` on estimates."""

    kinds = lander_vectoring.State, VectoringState, VectoringSignals


@dataclass(frozen=True, kw_only=True)
class EstimatedDescent(_OnEstimates, powered_descent.PoweredDescent, Navigation):
    """``powered_descent.PoweredDescent`` on estimates."""

    kinds = powered_descent.State, DescentState, DescentSignals
