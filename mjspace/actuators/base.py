"""Actuators: what a command makes the motors do; here those without any dynamics or limits."""

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from mjspace.contract import Array, Measurement

State = dict[str, Array]
"""What actuators remember, vehicle axis first."""
Fields = dict[str, tuple[int | tuple[int, ...], str]]
"""Fields of a command by name: shape for one vehicle, and unit."""
Limits = dict[str, tuple[Array, Array]]
"""Least and largest of fields of a command by name, each of the shape for one vehicle."""


class Actuators(Protocol):
    """The motors of a batch of vehicles: all memory in ``State``.

    Actuators that burn what they carry have a method ``masses(before, after)`` as well: for each
    field of MuJoCo's model that has changed, the body and the vehicles' values, (N, ...), in the
    middle of the integration step between these two states; and may have
    ``account_propellant(state, given, instead, step)``, which accounts for what is burnt where
    faults make them give ``instead``.
    """

    logged_as: ClassVar[str]
    """The field of /command that their torques are logged under."""

    @property
    def takes(self) -> Fields:
        """The fields of a command, each with its length for one vehicle and its unit."""

    acts_on: ClassVar[str]
    """MuJoCo's array that ``act`` fills: "ctrl", "qfrc_applied" for the bus's torque, or "userdata"
    for its magnetic moment [A m^2], body axes, in the environment's field."""

    @property
    def stateful(self) -> bool:
        """Whether they must act in every integration step; else once in a control period."""

    def reset(self, vehicles: int) -> State:
        """Return the state at the start."""

    def limits(self) -> Limits:
        """Return the least and the largest of each field that it takes, infinite where unlimited.

        They bound what can be applied; a command beyond them is not refused.
        """

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, torque, saturated) for ``step`` [s] from now; arrays (N, m).

        ``torque`` [N m] is on what each turns, ``saturated`` 1.0 for one that does not do as it is
        told.
        """

    def seen(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with what the motors themselves show."""


@dataclass(frozen=True)
class IdealThrusters:
    """Thrusters of which nothing is modelled but their torque, which is what the law asks for."""

    obeys: str = "torque"
    """The field of the command."""

    logged_as: ClassVar[str] = "thruster_torque"
    acts_on: ClassVar[str] = "qfrc_applied"
    stateful: ClassVar[bool] = False

    @property
    def takes(self) -> Fields:
        """The fields of a command."""
        return {self.obeys: (3, "N m")}

    def reset(self, vehicles: int) -> State:
        """Return no state."""
        return {}

    def limits(self) -> Limits:
        """Return no limits."""
        largest = np.full(3, np.inf)
        return {self.obeys: (-largest, largest)}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return the torque that is asked for, body axes, (N, 3); nothing is ever cut."""
        asked = getattr(command, self.obeys)
        torque = np.asarray(asked, dtype=float).reshape(truth.rate.shape)
        return state, torque, np.zeros((len(torque), 0))

    def seen(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth: thrusters show nothing."""
        return truth
