"""Actuators of several kinds side by side, each of which obeys its own field of the command."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mjspace.actuators import Actuators, State
from mjspace.addresses import is_thruster
from mjspace.contract import Array, Measurement
from mjspace.environment_kernel import MOMENT
from mjspace.errors import FlightError
from mjspace.thrusters import Thrusters


@dataclass(frozen=True)
class Together:
    """All that acts on a batch of vehicles; the fields of their states have different names."""

    kinds: tuple[Actuators, ...]

    @property
    def stateful(self) -> bool:
        """Whether any must act in every integration step."""
        return any(kind.stateful for kind in self.kinds)

    def masses(self, state: State) -> list[tuple[str, int, Array]]:
        """Return each field of MuJoCo's model that has changed, its body and the values."""
        burning = [kind.masses(state) for kind in self.kinds if hasattr(kind, "masses")]
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
            FlightError: the command has not what one of them takes.
        """
        given, cut = [], []
        for kind in self.kinds:
            try:
                after, torque, saturated = kind.act(state, command, truth, step)
            except Exception as error:
                raise FlightError(f"the law's command has no {kind.takes}: {error}") from error
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
