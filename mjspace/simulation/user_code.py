"""What users' code receives is read-only, and what it returns is checked."""

from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np

from mjspace.contract import Array, DesiredMotion, Measurement, Reference, ReferenceSource
from mjspace.errors import FlightError, failure
from mjspace.simulation.joined import of_whom

Tuple = TypeVar("Tuple", bound=Iterable[Any])

STEP = (
    "it must return (state, command, signals), each a named tuple of arrays; state and signals may "
    "be None"
)


class LocatedError(FlightError):
    """An error in users' code that says itself whose it is."""


class ReturnError(LocatedError):
    """A law returned anything but what it must return."""


def read_only(arrays: Tuple) -> Tuple:
    """Return the (named) tuple after making its arrays read-only, and the arrays they are views of.

    Writing into one of them then raises where it happens, and nobody who kept a reference can
    change what has been logged.
    """
    for array in arrays:
        while issubclass(type(array), np.ndarray):  # a traced array passes isinstance as well
            array.setflags(write=False)
            array = array.base
    return arrays


def sealed(measurement: Measurement) -> Measurement:
    """Return it after making its arrays read-only; those that are views are of read-only arrays."""
    for array in vars(measurement).values():
        if array.flags.writeable:
            array.setflags(write=False)
    return measurement


def reference_at(source: ReferenceSource, time: Array) -> DesiredMotion:
    """Return the reference at each ``time`` [s], shape (n,), read-only arrays with n rows.

    Raises:
        FlightError: the source raised, or returned no ``Reference`` of that many rows.
    """
    # BLAS rounds one row otherwise than several, and how many are asked for is a matter of chance.
    time = np.repeat(time, 2) if (alone := len(time) == 1) else time
    try:
        returned = source.at(time)
    except BaseException as error:
        raise failure("the reference", error) from error
    fields = getattr(returned, "_fields", ())
    if fields[: len(Reference._fields)] != Reference._fields:
        raise FlightError(
            f"the reference returned {_described(returned)}: it must return a named tuple that "
            f"begins with {', '.join(Reference._fields)}"
        )
    for field, rows in zip(fields, returned, strict=True):
        if len(np.shape(rows)) < 2 or len(rows) != len(time):
            raise FlightError(
                f"the reference's {field} has the shape {np.shape(rows)} for {len(time)} times: it "
                f"must be ({len(time)}, ...)"
            )
    return read_only(type(returned)(*(rows[:1] for rows in returned)) if alone else returned)


def check_state(state: Any, whose: str = "law") -> None:
    """Refuse what cannot be the state of a law or an estimator.

    Raises:
        ReturnError: neither a named tuple nor None.
    """
    if not _is_optional(state):
        raise ReturnError(
            f"the {whose}'s reset returned {_described(state)}: it must return its state, a named "
            "tuple of arrays, or None"
        )


def check_step(returned: Any) -> None:
    """Refuse what a law's ``step`` must not return.

    Raises:
        ReturnError: anything but (state, command, signals), with what it is instead.
    """
    if type(returned) is not tuple or len(returned) != 3:
        raise ReturnError(f"the law's step returned {_described(returned)}: {STEP}")
    state, command, signals = returned
    if not _is_named(command):
        raise ReturnError(
            f"the law's step returned {_described(returned)}: the command must be a named tuple of "
            "arrays, such as TorqueCommand(torque)"
        )
    for name, part in (("state", state), ("signals", signals)):
        if not _is_optional(part):
            raise ReturnError(
                f"the law's step returned {_described(returned)}: the {name} must be a named tuple "
                "of arrays, or None"
            )


def check_estimate(returned: Any) -> None:
    """Refuse what an estimator's ``step`` must not return.

    Raises:
        ReturnError: anything but (state, estimate), with what it is instead.
    """
    good = type(returned) is tuple and len(returned) == 2
    if not (good and _is_optional(returned[0]) and _is_named(returned[1])):
        raise ReturnError(
            f"the estimator's step returned {_described(returned)}: it must return (state, "
            "estimate), each a named tuple of arrays; state may be None"
        )


def check_inner(returned: Any) -> None:
    """Refuse what a law's inner loop must not return.

    Raises:
        ReturnError: anything but (state, command), with what was returned.
    """
    good = type(returned) is tuple and len(returned) == 2
    if not (good and _is_optional(returned[0]) and _is_named(returned[1])):
        raise ReturnError(
            f"the law's inner loop returned {_described(returned)}: it must return (state, "
            "command), named tuples of arrays; state may be None"
        )


def check_vehicle_axis(name: str, arrays: Any, vehicles: int) -> None:
    """Refuse a batched law's tuple in which an array does not begin with the vehicle axis.

    Raises:
        ReturnError: the first such field, with its shape.
    """
    for whose, fields in of_whom(name, arrays).items():
        for field, array in fields.items():
            if not isinstance(array, np.ndarray):
                raise ReturnError(f"{whose}.{field} must be an array, of a batched law")
            if not array.shape or array.shape[0] != vehicles:
                raise ReturnError(
                    f"{whose}.{field} has the shape {array.shape}: of a batched law it must begin "
                    f"with the vehicle axis, ({vehicles}, ...)"
                )


def shapes_of(returned: Any) -> list[tuple[int, ...]] | None:
    """Return the shapes of all arrays in (state, command, signals); None where it is not that."""
    try:
        state, command, signals = returned
        return [array.shape for part in (state, command, signals) for array in part or ()]
    except (AttributeError, TypeError, ValueError):
        return None


def check_same_shapes(name: str, arrays: Any, first: Any) -> None:
    """Refuse a law's tuple whose fields or their shapes are not those of its ``first``.

    Raises:
        ReturnError: with the fields or the shapes that differ.
    """
    of_before = of_whom(name, first)
    for whose, fields in of_whom(name, arrays).items():
        now, before = (
            {field: np.shape(array) for field, array in found.items()}
            for found in (fields, of_before.get(whose, {}))
        )
        if now.keys() != before.keys():
            raise ReturnError(f"{whose} has the fields {list(now)} after {list(before)}")
        for field, shape in now.items():
            if shape != before[field]:
                raise ReturnError(
                    f"{whose}.{field} has the shape {shape} after {before[field]}: shapes must not "
                    "change"
                )


def _is_named(value: Any) -> bool:
    return isinstance(value, tuple) and hasattr(value, "_fields")


def _is_optional(value: Any) -> bool:
    return value is None or _is_named(value) or (isinstance(value, tuple) and not value)


def _described(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    if type(value) is tuple:
        return f"({', '.join(map(_described, value))})"
    return "None" if value is None else f"a {type(value).__name__}"
