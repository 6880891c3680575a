"""The ideal contraction law of paper 002 without a rate measurement, at a known inertia.

Paper 002 leaves output feedback for later. The observer's error obeys an equation of its own
(``rate_observer``), so that the law follows it in cascade: a hierarchy of contracting systems.
"""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from mjspace.contract import Array, Measurement, Reference, TorqueCommand

from .contraction import Ideal, IdealState
from .rate_observer import RateObserverGains, RateState


class State(NamedTuple):
    """Memory of the law: that of the ideal law and of the observer."""

    attitude: Array
    """Last measured quaternion, on the branch chosen at reset, (..., 4)."""
    observed_attitude: Array
    """Quaternion, body to inertial, (..., 4)."""
    momentum: Array
    """Estimated total momentum, inertial axes [N m s], (..., 3)."""


class Signals(NamedTuple):
    """Signals of the law."""

    e: Array
    """w_o - wd [rad/s], body axes, (..., 3)."""
    wd: Array
    """Desired rate [rad/s], body axes, (..., 3)."""
    estimated_rate: Array
    """w_o [rad/s], body axes, (..., 3)."""


@dataclass(frozen=True, kw_only=True)
class OutputFeedback(Ideal, RateObserverGains):
    """The ideal law at the observed rate; ``measurement.rate`` is not read."""

    batched: ClassVar[bool] = True

    def reset(  # type: ignore[override]
        self, measurement: Measurement, reference: Reference
    ) -> State:
        """Return the initial state, of an estimated rate of zero."""
        return State(*super().reset(measurement, reference), *self.at_rest(measurement))

    def step(  # type: ignore[override]
        self, state: State, time: float, measurement: Measurement, reference: Reference
    ) -> tuple[State, TorqueCommand, Signals]:
        """Return the next state, the torque, the errors and the estimate."""
        attitude, *observer = state
        observed, w, _ = self.observed(RateState(*observer), measurement)
        seen = measurement._replace(rate=w)
        after, command, signals = super().step(IdealState(attitude), time, seen, reference)
        return State(*after, *observed), command, Signals(*signals, w)
