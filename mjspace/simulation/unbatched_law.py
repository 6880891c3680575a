"""Flying a law written for one vehicle: each vehicle in turn, with results stacked."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mjspace.contract import DesiredMotion, Law, Measurement
from mjspace.simulation.user_code import ReturnError, check_state, check_step


class UnbatchedLaw:
    """A law of arrays without a vehicle axis, flown on arrays with one."""

    def __init__(self, law: Law) -> None:
        self._law = law

    def reset(self, measurement: Measurement, reference: DesiredMotion) -> Any:
        """Return the law's state with a vehicle axis."""
        states = [self._law.reset(one, reference) for one in _measured(measurement)]
        for state in states:
            check_state(state)
        return _stack("state", states)

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: DesiredMotion
    ) -> tuple[Any, Any, Any]:
        """Return the law's state, command and signals with a vehicle axis."""
        states = _vehicles(state) if state else [state] * len(measurement.rate)
        flown = [
            self._law.step(s, time, m, reference)
            for s, m in zip(states, _measured(measurement), strict=True)
        ]
        for returned in flown:
            check_step(returned)
        after, commands, signals = zip(*flown, strict=True)
        return _stack("state", after), _stack("command", commands), _stack("signals", signals)


def _measured(measurement: Measurement) -> list[Measurement]:
    """Return the measurement of each vehicle, without the vehicle axis."""
    kind, names = type(measurement), measurement._fields
    rows = zip(*measurement._asdict().values(), strict=True)
    return [kind(**dict(zip(names, row, strict=True))) for row in rows]


def _vehicles(arrays: Any) -> list[Any]:
    return [type(arrays)(*row) for row in zip(*arrays, strict=True)]


def _stack(name: str, tuples: Sequence[Any]) -> Any:
    """Return the named tuples as one, a vehicle axis before each field; None is an empty tuple.

    Raises:
        ReturnError: a field is not numeric, or fields or shapes differ between vehicles.
    """
    names = [getattr(one, "_fields", ()) for one in tuples]
    for other in names[1:]:
        if other != names[0]:
            raise ReturnError(
                f"the law's {name} has the fields {list(names[0])} for one vehicle and "
                f"{list(other)} for another: it must return the same for all"
            )
    if not tuples[0]:
        return ()
    fields = []
    for field, column in zip(tuples[0]._fields, zip(*tuples, strict=True), strict=True):
        try:
            fields.append(np.array(column, dtype=float))
        except (TypeError, ValueError) as error:
            raise ReturnError(
                f"the law's {name}.{field} is not an array of numbers: {error}"
            ) from error
    return type(tuples[0])(*fields)
