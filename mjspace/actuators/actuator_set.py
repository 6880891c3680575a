"""Actuators of several kinds side by side, each of which obeys its own field of the command."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mjspace.actuators.base import Actuators, State
from mjspace.actuators.thrusters import Thrusters
from mjspace.contract import Array, Measurement
from mjspace.environment.magnetic_field import MOMENT
from mjspace.errors import FlightError
from mjspace.vehicle.indices import is_thruster


@dataclass(frozen=True)
class ActuatorSet:
    """All that acts on a batch of vehicles; the fields of their states have different names."""

    kinds: tuple[Actuators, ...]

    @property
    def stateful(self) -> bool:
        """Whether any must act in every integration step."""
        return any(kind.stateful for kind in self.kinds)

    def masses(self, before: State, after: State) -> list[tuple[str, int, Array]]:
        """Return each field of MuJoCo's model that burning changes, its body and the values.

        They are those in the middle of the integration step from ``before`` to ``after``.
        """
        burning = [kind.masses(before, after) for kind in self.kinds if hasattr(kind, "masses")]
        return [(name, *change) for masses in burning for name, change in masses.items()]

    def inputs(self, batch: Any, motors: Sequence[str]) -> list[Array]:
        """Return, of each kind, what it fills: a view of an input of the ``batch``.

        ``motors`` are the vehicle's: the thrusters' inputs are the last, the others' the first.
        """
        thrusters = sum(map(is_thruster, motors))
        views = []
        for kind in self.kinds:
            view = batch.bind(kind.acts_on)
            part = slice(len(motors) - thrusters)
            if kind.acts_on == "qfrc_applied":
                part = slice(3, 6)  # the free joint comes first, its torque in body axes
            elif kind.acts_on == "userdata":
                part = MOMENT
            elif isinstance(kind, Thrusters):
                part = slice(view.shape[1] - thrusters, None)
            views.append(view[:, part])
        return views

    def reset(self, vehicles: int) -> State:
        """Return the state of all at the start."""
        return {name: a for kind in self.kinds for name, a in kind.reset(vehicles).items()}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, tuple[Array, ...], Array]:
        """Return (state, what each kind gives, saturated) as ``Actuators.act`` does.

        Raises:
            FlightError: a field of the command is missing or misshapen. What an actuator raises
                itself is passed on as it is.
        """
        given, cut = [], []
        for kind in self.kinds:
            _check(command, kind, len(truth.rate))
            after, torque, saturated = kind.act(state, command, truth, step)
            state = state | after
            given.append(torque)
            cut.append(saturated)
        return state, tuple(given), np.concatenate(cut, axis=-1)

    def seen(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with what the motors themselves show."""
        for kind in self.kinds:
            truth = kind.seen(state, truth)
        return truth

    def logged(self, given: Sequence[tuple[Array, ...]]) -> dict[str, Array]:
        """Return the fields of /command for what ``act`` gave in several periods."""
        columns = zip(*given, strict=True)
        return {k.logged_as: np.array(c) for k, c in zip(self.kinds, columns, strict=True)}


def set_masses(batch: Any, masses: list[tuple[str, int, Array]]) -> None:
    """Give bodies the masses of the middle of the integration step.

    The constants that MuJoCo derives from them take 0.6 of a step's time: they are derived again
    only where something burns.
    """
    fields = [(batch.expand(name)[:, body], values) for name, body, values in masses]
    if any(not np.array_equal(field, values) for field, values in fields):
        for field, values in fields:
            field[:] = values
        batch.set_const()


def _check(command: Any, kind: Actuators, vehicles: int) -> None:
    """Raise FlightError where the law's ``command`` lacks a field that ``kind`` obeys.

    Every field has the vehicle axis first, as the log has.
    """
    for name, (width, unit) in kind.takes.items():
        value = getattr(command, name, None)
        shape = (vehicles, *((width,) if isinstance(width, int) else width))
        if isinstance(value, np.ndarray) and value.shape == shape and value.dtype == float:
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
