"""A law that flies on estimates: an estimator and a law as one law."""

from collections.abc import Callable
from typing import Any

from mjspace.contract import DesiredMotion, Estimator, Law, Measurement
from mjspace.errors import failure
from mjspace.simulation.joined import ESTIMATOR, LAW, join, separate
from mjspace.simulation.user_code import (
    LocatedError,
    check_estimate,
    check_state,
    check_step,
    read_only,
)
from mjspace.tracing.inner_loops import Untraceable


def refuse_inner_loop(law: Law) -> None:
    """Refuse a law that sees the sensors where nothing is estimated.

    Raises:
        ValueError: the law has an inner loop.
    """
    if hasattr(law, "inner"):
        raise ValueError(
            f"the inner loop of {type(law).__name__} sees the sensors in every integration step, "
            "where nothing is estimated: leave out [estimator], or name a law without an inner loop"
        )


class EstimatedLaw:
    """A law whose measurement has what the estimator estimates in place of what is measured.

    Its state is that of both, its signals are the estimate and the law's signals, as ``joined`` has
    them.

    Attributes:
        estimator, law: the two.
        batched: whether both are; else both see the arrays of one vehicle.
        compiled: whether both may be flown compiled.
    """

    def __init__(self, estimator: Estimator, law: Law) -> None:
        self.estimator, self.law = estimator, law
        both = estimator, law
        self.batched = all(getattr(each, "batched", False) for each in both)
        self.compiled = all(getattr(each, "compiled", True) for each in both)

    def reset(self, measurement: Measurement, reference: DesiredMotion) -> Any:
        """Return the state of both; that of the law by the first estimate.

        Raises:
            LocatedError: the estimator raised, or returned anything but what it must.
        """
        state = _of_estimator(self.estimator.reset, measurement)
        check_state(state, "estimator")
        _, estimate = self._estimate(state, 0.0, measurement)
        own = self.law.reset(measurement._replace(**estimate._asdict()), reference)
        check_state(own)
        return join(state, own)

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: DesiredMotion
    ) -> tuple[Any, Any, Any]:
        """Return (state of both, the law's command, estimate and signals).

        Raises:
            LocatedError: as ``reset``.
        """
        before = separate(state)
        after, estimate = self._estimate(before.get(ESTIMATOR, ()), time, measurement)
        seen = measurement._replace(**estimate._asdict())
        returned = self.law.step(before[LAW], time, seen, reference)
        check_step(returned)
        of_law, command, signals = returned
        return join(after, of_law), command, join(estimate, signals)

    def _estimate(self, state: Any, time: float, measurement: Measurement) -> tuple[Any, Any]:
        """Return the estimator's next state and its estimate, read-only."""
        returned = _of_estimator(self.estimator.step, state, time, measurement)
        check_estimate(returned)
        return returned[0], read_only(returned[1])


def _of_estimator(method: Callable[..., Any], *arguments: Any) -> Any:
    """Return what a ``method`` of the estimator returns.

    Raises:
        LocatedError: it raised.
    """
    try:
        return method(*arguments)
    except Untraceable:
        raise
    except BaseException as error:
        raise LocatedError(str(failure("the estimator", error))) from error
