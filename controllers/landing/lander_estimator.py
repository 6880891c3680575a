"""The lander's laws on the estimates of a navigation filter: future work of paper 003.

Measured position, velocity and attitude are read once, as the last fix before the descent.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import Array, Measurement, Trajectory

from . import lander, lander_vectoring, powered_descent
from .lander_filter import FilterState, Navigation
from .landing_site import SiteReference


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


@dataclass(frozen=True, kw_only=True)
class EstimatedStructure(lander.VariableStructure, Navigation):
    """``lander.VariableStructure`` on estimates."""

    def reset(self, measurement: Measurement, reference: Trajectory) -> Any:
        """Return the law's initial state and the initial estimates."""
        return StructureState(*super().reset(measurement, reference), *self.fix(measurement))

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Trajectory
    ) -> tuple[Any, Any, Any]:
        """Return the next state, the command, and the signals of law and filter."""
        estimate, estimated = _navigated(self, state, measurement)
        own = lander.State(*state[: -len(FilterState._fields)])
        after, command, signals = super().step(own, time, estimated, reference)
        joined = StructureSignals(*signals, *_estimates(estimate))
        return StructureState(*after, *estimate), command, joined


@dataclass(frozen=True, kw_only=True)
class EstimatedVectoring(lander_vectoring.ThrustVectoring, Navigation):
    """``lander_vectoring.ThrustVectoring`` on estimates."""

    def reset(self, measurement: Measurement, reference: Trajectory) -> Any:
        """Return the law's initial state and the initial estimates."""
        return VectoringState(*super().reset(measurement, reference), *self.fix(measurement))

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: Trajectory
    ) -> tuple[Any, Any, Any]:
        """Return the next state, the command, and the signals of law and filter."""
        estimate, estimated = _navigated(self, state, measurement)
        own = lander_vectoring.State(*state[: -len(FilterState._fields)])
        after, command, signals = super().step(own, time, estimated, reference)
        joined = VectoringSignals(*signals, *_estimates(estimate))
        return VectoringState(*after, *estimate), command, joined


@dataclass(frozen=True, kw_only=True)
class EstimatedDescent(powered_descent.PoweredDescent, Navigation):
    """``powered_descent.PoweredDescent`` on estimates."""

    def reset(self, measurement: Measurement, reference: Trajectory) -> Any:
        """Return the law's initial state and the initial estimates."""
        return DescentState(*super().reset(measurement, reference), *self.fix(measurement))

    def step(  # type: ignore[override]
        self, state: Any, time: float, measurement: Measurement, reference: SiteReference
    ) -> tuple[Any, Any, Any]:
        """Return the next state, the command, and the signals of law and filter."""
        estimate, estimated = _navigated(self, state, measurement)
        own = powered_descent.State(*state[: -len(FilterState._fields)])
        after, command, signals = super().step(own, time, estimated, reference)
        joined = DescentSignals(*signals, *_estimates(estimate))
        return DescentState(*after, *estimate), command, joined


def _navigated(
    navigation: Navigation, state: Any, measurement: Measurement
) -> tuple[FilterState, Measurement]:
    """Return the filter's next state, and the measurement with its estimates."""
    estimate = navigation.navigate(FilterState(*state[-len(FilterState._fields) :]), measurement)
    return estimate, navigation.estimated(estimate, measurement)


def _estimates(estimate: FilterState) -> Estimates:
    variance = np.diagonal(estimate.covariance, axis1=-2, axis2=-1)[..., :9]
    return Estimates(*estimate[:3], np.sqrt(variance))
