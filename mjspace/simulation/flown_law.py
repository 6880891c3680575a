"""The law in flight: its state, what it returns, and what it raises."""

from typing import Any

import numpy as np

from mjspace.contract import DesiredMotion, Law, Measurement
from mjspace.errors import failure
from mjspace.simulation.user_code import (
    ReturnError,
    check_inner,
    check_same_shapes,
    check_state,
    check_step,
    check_vehicle_axis,
    read_only,
    shapes_of,
)


class FlownLaw:
    """A law with its state; each step is checked, and its errors are named as the law's.

    Attributes:
        state: the law's state before its next step, a named tuple or empty; None: not yet reset.
    """

    def __init__(self, law: Law, state: Any, vehicles: int) -> None:
        """Fly ``law`` on so many vehicles, from its ``state``; None: it is reset at the start."""
        self._law: Any = law
        self.state = state
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
        try:
            if self.state is None:
                state = self._law.reset(measurement, reference)
                check_state(state)
                self.state = _kept(state)
            before = self.state
            returned = self._law.step(before, time, measurement, reference)
        except ReturnError:
            raise
        except BaseException as error:
            raise failure("the law", error) from error
        self._check(before, returned)
        state, command, signals = returned
        self.state = _kept(state)
        return before, read_only(command), read_only(signals or ())

    def inner(self, time: float, command: Any, measurement: Measurement) -> Any:
        """Return the motors' command that the inner loop makes of the step's ``command``.

        Raises:
            FlightError: the inner loop raised, or returned anything but (state, command).
        """
        try:
            returned = self._law.inner(self.state, time, command, measurement)
        except BaseException as error:
            raise failure("the law's inner loop", error) from error
        check_inner(returned)
        self.state = _kept(returned[0])
        return returned[1]

    def _check(self, before: Any, returned: Any) -> None:
        """Refuse what the law's step must not return, on its first step or any later one."""
        names = ("state", "command", "signals")
        if self._first is None:
            check_step(returned)
            for name, part in zip(names, returned, strict=True):
                check_vehicle_axis(name, part, self._vehicles)
            self._first = (before, *returned[1:])
            self._shapes = shapes_of(self._first)
        if shapes_of(returned) != self._shapes:
            check_step(returned)
            for name, part, first in zip(names, returned, self._first, strict=True):
                check_same_shapes(name, part, first)


def _kept(state: Any) -> Any:
    """Return a law's state as a log keeps it, read-only.

    Of an array that lies otherwise, a transposed one for example, NumPy adds up in another order:
    a flight from a logged state would differ in the last digits.
    """
    if not state:
        return ()
    return read_only(type(state)(*(np.asarray(array, order="C") for array in state)))
