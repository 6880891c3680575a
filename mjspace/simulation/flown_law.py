"""The law in flight: its state, what it returns, and what it raises."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mjspace.contract import Array, DesiredMotion, Law, Measurement
from mjspace.errors import failure
from mjspace.simulation.unbatched_law import UnbatchedLaw, stacked
from mjspace.simulation.user_code import (
    LocatedError,
    check_inner,
    check_same_shapes,
    check_state,
    check_step,
    check_vehicle_axis,
    read_only,
    shapes_of,
)

_PARTS = ("state", "command", "signals")


class FlownLaw:
    """A law with its state; each step is checked, and its errors are named as the law's.

    Attributes:
        state: the law's state before its next step, a named tuple or empty; None: not yet reset.
        called: (time [s], state, command, signals) of its next step, where it has been called for
            that already; else None. A law may remember more than its state.
    """

    def __init__(self, law: Law, state: Any, vehicles: int) -> None:
        """Fly ``law`` on so many vehicles, from its ``state``; None: it is reset at the start."""
        self._law: Any = law
        self._own: Any = law.law if isinstance(law, UnbatchedLaw) else law
        self.state = state
        self.called: tuple[float, Any, Any, Any] | None = None
        self._vehicles = vehicles
        self._first: Any = None
        self._shapes: list[tuple[int, ...]] | None = None

    def step(
        self, time: float, measurement: Measurement, reference: DesiredMotion
    ) -> tuple[Any, Any, Any]:
        """Return (state before the step, command, signals) at ``time`` [s], read-only.

        Raises:
            FlightError: the law raised, or returned anything but (state, command, signals) of the
                same shapes as before.
        """
        if self.state is None:
            self.reset(measurement, reference)
        before, called, self.called = self.state, self.called, None
        if called is not None and called[0] == time:
            _, self.state, *others = called
            return before, *others
        returned = _called(self._law.step, before, time, measurement, reference)
        self._check(before, returned)
        state, command, signals = returned
        self.state = _kept(state)
        return before, read_only(command), read_only(signals or ())

    def reset(self, measurement: Measurement, reference: DesiredMotion) -> None:
        """Put the law into the state in which a flight starts.

        Raises:
            FlightError: it raised, or returned what cannot be a state.
        """
        state = _called(self._law.reset, measurement, reference)
        check_state(state)
        self.state = _kept(state)

    @property
    def one_by_one(self) -> bool:
        """Whether the law is called for each vehicle by itself."""
        return self._own is not self._law

    def call(
        self, state: Any, time: float, measurement: Measurement, reference: DesiredMotion
    ) -> Any:
        """Return what the law's own step returns, for one vehicle where it is flown so.

        Raises:
            FlightError: it raised.
        """
        return _called(self._own.step, state, time, measurement, reference)

    def arrays_of(self, returned: Any, check: Callable[[Any], None]) -> list[Array]:
        """Return the arrays of what ``call`` returned, in a period after the first.

        Raises:
            FlightError: it is not what it must be, of the same shapes as before; or its command is
                refused by ``check``.
        """
        check_step(returned)
        if not self.one_by_one:
            self._check_shapes(returned, self._first)
            check(returned[1])
            return [array for part in returned for array in part or ()]
        parts = stacked([returned])
        self._check_shapes(parts, [_of_one(part) for part in self._first])
        return [array[0] for part in parts for array in part]

    def inner(self, time: float, command: Any, measurement: Measurement) -> Any:
        """Return the motors' command that the inner loop makes of the step's ``command``.

        Raises:
            FlightError: the inner loop raised, or returned anything but (state, command).
        """
        try:
            returned = self._law.inner(self.state, time, command, measurement)
        except LocatedError:
            raise
        except BaseException as error:
            raise failure("the law's inner loop", error) from error
        check_inner(returned)
        self.state = _kept(returned[0])
        return returned[1]

    def _check(self, before: Any, returned: Any) -> None:
        """Refuse what the law's step must not return, on its first step or any later one."""
        if self._first is None:
            check_step(returned)
            for name, part in zip(_PARTS, returned, strict=True):
                check_vehicle_axis(name, part, self._vehicles)
            self._first = (before, *returned[1:])
            self._shapes = shapes_of(self._first)
        if shapes_of(returned) != self._shapes:
            check_step(returned)
            self._check_shapes(returned, self._first)

    def _check_shapes(self, returned: Any, first: Any) -> None:
        named = zip(_PARTS, returned, first, strict=True)
        # The command comes last: it may be otherwise because an estimate is.
        for name, part, before in sorted(named, key=lambda each: each[0] == "command"):
            check_same_shapes(name, part, before)


def _of_one(arrays: Any) -> Any:
    """Return a named tuple, or nothing, with the first vehicle alone."""
    return type(arrays)(*(array[:1] for array in arrays)) if arrays else ()


def _called(method: Callable[..., Any], *arguments: Any) -> Any:
    """Return what a ``method`` of the law returns.

    Raises:
        FlightError: it raised.
    """
    try:
        return method(*arguments)
    except LocatedError:
        raise
    except BaseException as error:
        raise failure("the law", error) from error


def _kept(state: Any) -> Any:
    """Return a law's state as a log keeps it, read-only.

    Of an array that lies otherwise, a transposed one for example, NumPy adds up in another order:
    a flight from a logged state would differ in the last digits.
    """
    if not state:
        return ()
    return read_only(type(state)(*(np.asarray(array, order="C") for array in state)))
