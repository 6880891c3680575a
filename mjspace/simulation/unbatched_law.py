"""Flying a law written for one vehicle: each vehicle in turn, with results stacked."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mjspace.contract import DesiredMotion, Law, Measurement
from mjspace.simulation.joined import of_whom
from mjspace.simulation.user_code import ReturnError, check_inner, check_state, check_step


class UnbatchedLaw:
    """A law of arrays without a vehicle axis, flown on arrays with one.

    Attributes:
        law: that law.
    """

    def __init__(self, law: Law) -> None:
        self.law = law

    def reset(self, measurement: Measurement, reference: DesiredMotion) -> Any:
        """Return the law's state with a vehicle axis."""
        vehicles = range(len(measurement.rate))
        states = [self.law.reset(_of_vehicle(measurement, v), reference) for v in vehicles]
        for state in states:
            check_state(state)
        return _stack("state", states)

    def step(
        self, state: Any, time: float, measurement: Measurement, reference: DesiredMotion
    ) -> tuple[Any, Any, Any]:
        """Return the law's state, command and signals with a vehicle axis."""
        return stacked(
            [
                self._step(v, state, time, measurement, reference)
                for v in range(len(measurement.rate))
            ]
        )

    def inner(
        self, state: Any, time: float, command: Any, measurement: Measurement
    ) -> tuple[Any, Any]:
        """Return the law's state and the motors' command with a vehicle axis."""
        law: Any = self.law
        returned = []
        for vehicle in range(len(measurement.rate)):
            own, desired = _row(state, vehicle), _row(command, vehicle)
            returned.append(law.inner(own, time, desired, _of_vehicle(measurement, vehicle)))
            check_inner(returned[-1])
        states, commands = zip(*returned, strict=True)
        return _stack("state", states), _stack("command", commands)

    def step_of_one(
        self, state: Any, time: Any, measurement: Measurement, reference: DesiredMotion
    ) -> tuple[Any, Any, Any]:
        """Return what ``step`` does, for arrays of one vehicle that may be traced."""
        returned = self._step(0, state, time, measurement, reference)
        after, command, signals = (_with_axis(part) if part else () for part in returned)
        return after, command, signals

    def _step(
        self, vehicle: int, state: Any, time: Any, measurement: Measurement, reference: Any
    ) -> tuple[Any, Any, Any]:
        """Return what the law returns for that vehicle."""
        own = _row(state, vehicle)
        returned = self.law.step(own, time, _of_vehicle(measurement, vehicle), reference)
        check_step(returned)
        return returned


def stacked(returned: Sequence[tuple[Any, Any, Any]]) -> tuple[Any, Any, Any]:
    """Return the (state, command, signals) of vehicles as those of all, a vehicle axis first.

    Raises:
        ReturnError: as ``_stack``.
    """
    state, command, signals = zip(*returned, strict=True)
    return _stack("state", state), _stack("command", command), _stack("signals", signals)


def _row(arrays: Any, vehicle: int) -> Any:
    """Return a vehicle's part of a named tuple, or nothing."""
    return type(arrays)(*(array[vehicle] for array in arrays)) if arrays else arrays


def _of_vehicle(measurement: Measurement, vehicle: int) -> Measurement:
    return measurement._map(lambda array: array[vehicle])


def _with_axis(arrays: Any) -> Any:
    """Return the named tuple with a vehicle axis before each field, as floats."""
    floats = [a if hasattr(a, "astype") else np.asarray(a, dtype=float) for a in arrays]
    return type(arrays)(*(each.astype(float)[None] for each in floats))


def _stack(name: str, tuples: Sequence[Any]) -> Any:
    """Return the named tuples as one, a vehicle axis before each field; None is an empty tuple.

    Raises:
        ReturnError: a field is not numeric, or fields or shapes differ between vehicles.
    """
    first = of_whom(name, tuples[0])
    for one in tuples[1:]:
        for whose, own in of_whom(name, one).items():
            if own.keys() != first[whose].keys():
                raise ReturnError(
                    f"{whose} has the fields {list(first[whose])} for one vehicle and {list(own)} "
                    "for another: it must return the same for all"
                )
    if not tuples[0]:
        return ()
    fields = []
    labels = [f"{whose}.{field}" for whose, own in first.items() for field in own]
    for label, column in zip(labels, zip(*tuples, strict=True), strict=True):
        try:
            fields.append(np.array(column, dtype=float))
        except (TypeError, ValueError) as error:
            raise ReturnError(f"{label} is not an array of numbers: {error}") from error
    return type(tuples[0])(*fields)
