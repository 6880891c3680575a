"""Actuators of several kinds side by side, each of which obeys its own fields of the command."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any, TypeVar

import numpy as np

from mjspace.actuators.base import Actuator, Fields, Input, State
from mjspace.contract import Array, Measurement
from mjspace.errors import FlightError, failure

Result = TypeVar("Result")
_FLOAT = np.dtype(float)


@dataclass(frozen=True)
class ActuatorSet:
    """All that acts on a batch of vehicles; the fields of their states have different names."""

    kinds: tuple[Actuator, ...]
    _declared: tuple[tuple[Fields, int], ...] = field(init=False, repr=False)
    """What each kind takes, and how many numbers it applies to a vehicle: looked up once."""

    def __post_init__(self) -> None:
        """Refuse kinds that would overwrite each other.

        Raises:
            ValueError: two kinds drive the same input, or are logged under the same name.
        """
        for one, other in combinations(self.kinds, 2):
            names = f"{type(one).__name__} and {type(other).__name__}"
            if _overlap(one.drives, other.drives):
                raise ValueError(f"{names} both drive {_described(one.drives)}: give one")
            if one.logged_as == other.logged_as:
                raise ValueError(f"{names} are both logged as command.{one.logged_as}: give one")
        declared = tuple((kind.takes, kind.drives.width) for kind in self.kinds)
        object.__setattr__(self, "_declared", declared)

    @property
    def stateful(self) -> bool:
        """Whether any must act in every integration step."""
        return any(kind.stateful for kind in self.kinds)

    @property
    def units(self) -> dict[str, dict[str, str]]:
        """The SI units of what they command and measure, by topic and field of the log."""
        command, measured = dict[str, str](), dict[str, str]()
        for kind in self.kinds:
            command |= {name: unit for name, (_, unit) in kind.takes.items()}
            command[kind.logged_as] = kind.unit
            measured |= kind.measures
        return {"/command": command, "/truth": measured, "/measurement": measured}

    def masses(self, before: State, after: State) -> list[tuple[str, int, Array]]:
        """Return each field of MuJoCo's model that burning changes, its body and the values.

        They are those in the middle of the integration step from ``before`` to ``after``.
        """
        burning = [_of(kind, kind.masses, before, after) for kind in self.kinds]
        return [(name, *change) for masses in burning for name, change in masses.items()]

    def inputs(self, batch: Any) -> list[list[tuple[Array, slice]]]:
        """Return, of each kind, the views of the ``batch``'s inputs that it fills, and with what.

        That is part of the numbers that it applies: all of them, where its motors stand side by
        side.
        """
        return [
            [
                (batch.bind(kind.drives.array)[:, columns], part)
                for columns, part in kind.drives.runs(batch.model)
            ]
            for kind in self.kinds
        ]

    def reset(self, vehicles: int) -> State:
        """Return the state of all at the start."""
        states = [_of(kind, kind.reset, vehicles) for kind in self.kinds]
        return {name: array for state in states for name, array in state.items()}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, tuple[Array, ...], Array]:
        """Return (state, what each kind applies, saturated) as ``Actuator.act`` does.

        Raises:
            FlightError: a field of the command is missing or misshapen, or an actuator raises or
                applies an array of another shape than that of its input.
        """
        vehicles = len(truth.rate)
        applied, saturated = list[Array](), [np.zeros((vehicles, 0))]  # of none
        for kind, (takes, width) in zip(self.kinds, self._declared, strict=True):
            _check(command, takes, vehicles)
            after, output, cut = _of(kind, kind.act, state, command, truth, step)
            if output.shape != (vehicles, width):
                raise FlightError(
                    f"the actuator {type(kind).__name__} applies an array of shape {output.shape}: "
                    f"it must be {(vehicles, width)}"
                )
            state = state | after
            applied.append(output)
            saturated.append(cut)
        return state, tuple(applied), np.concatenate(saturated, axis=-1)

    def check(self, command: Any, vehicles: int) -> None:
        """Refuse a ``command`` that they cannot obey.

        Raises:
            FlightError: a field that a kind takes is missing or misshapen.
        """
        for takes, _ in self._declared:
            _check(command, takes, vehicles)

    def measured(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with what the actuators' own sensors measure."""
        for kind in self.kinds:
            truth = _of(kind, kind.measured, state, truth)
        return truth

    def logged(self, applied: Iterable[Array]) -> dict[str, Array]:
        """Return the fields of /command for what each kind applied."""
        return {kind.logged_as: values for kind, values in zip(self.kinds, applied, strict=True)}


def _overlap(one: Input, other: Input) -> bool:
    """Return whether the two inputs share a number."""
    if one.array != other.array:
        return False
    if set(one.motors) & set(other.motors):
        return True
    return bool(set(one.columns) & set(other.columns))


def _described(driven: Input) -> str:
    if driven.motors:
        return f"the motors {', '.join(driven.motors)}"
    return f"{driven.array}[{driven.columns.start}:{driven.columns.stop}]"


def _of(kind: Actuator, method: Callable[..., Result], *arguments: Any) -> Result:
    """Return what the ``method`` of ``kind`` returns.

    Raises:
        FlightError: it raised; with the actuator, what it raised and in which line.
    """
    try:
        return method(*arguments)
    except BaseException as error:
        name = f"the actuator {type(kind).__name__} ({kind.logged_as})"
        raise failure(name, error) from error


def _check(command: Any, takes: Fields, vehicles: int) -> None:
    """Raise FlightError where the law's ``command`` lacks a field that an actuator ``takes``.

    Every field has the vehicle axis first, as the log has.
    """
    for name, (width, unit) in takes.items():
        value = getattr(command, name, None)
        shape = (vehicles, *((width,) if isinstance(width, int) else width))
        # By its attributes: a traced array is not an np.ndarray.
        if getattr(value, "shape", None) == shape and getattr(value, "dtype", None) == _FLOAT:
            continue  # in a quarter of a microsecond
        right = f"it must be of shape {_without_vehicles(shape)} [{unit}]"
        if value is None:
            has = ", ".join(getattr(command, "_fields", ())) or "none"
            raise FlightError(
                f"the law's command, {_a(command)}, has no field {name!r}: {right}; "
                f"its fields are: {has}"
            )
        try:
            array = np.asarray(value, dtype=float)
        except (TypeError, ValueError) as error:
            raise FlightError(
                f"the law's command: {name} is not numbers ({error}): {right}"
            ) from error
        if array.shape != shape:
            found = (
                _without_vehicles(array.shape) if array.shape[:1] == (vehicles,) else array.shape
            )
            raise FlightError(f"the law's command: {name} has shape {found}: {right}")


def _without_vehicles(shape: tuple[int, ...]) -> str:
    """Return the shape as a law knows it: any vehicle axes, and then one vehicle's."""
    return f"({', '.join(['...', *map(str, shape[1:])])})"


def _a(command: Any) -> str:
    return f"a {type(command).__name__}"
