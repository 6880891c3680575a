"""What an actuator is: a table that a scenario fills in, and the kind of actuator built from it."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from mjspace.contract import Array, Measurement
from mjspace.environment.magnetic_field import MOMENT
from mjspace.scenario.equipment import Driven, Equipment
from mjspace.scenario.plant import Initial, Rates
from mjspace.vehicle.vehicle import Vehicle

State = dict[str, Array]
"""What actuators remember, vehicle axis first."""
Fields = Mapping[str, tuple[int | tuple[int, ...], str]]
"""Fields of a command by name: shape for one vehicle, and unit."""
Limits = dict[str, tuple[Array, Array]]
"""Least and largest of fields of a command by name, each of the shape for one vehicle."""


@dataclass(frozen=True)
class Input:
    """What an actuator drives: some columns of one of MuJoCo's arrays."""

    array: str
    """MuJoCo's name of the array."""
    motors: tuple[str, ...] = ()
    """Of ``ctrl``: the motors by name, in the order of what is applied."""
    columns: range = range(0)
    """Of any other array."""

    @property
    def width(self) -> int:
        """How many numbers are applied to one vehicle."""
        return len(self.motors) or len(self.columns)

    def runs(self, model: Any) -> list[tuple[slice, slice]]:
        """Return (columns of the array of a vehicle of that ``model``, numbers that go there).

        Motors that do not stand side by side in ``ctrl`` make several.
        """
        if not self.motors:
            return [(slice(self.columns.start, self.columns.stop), slice(0, len(self.columns)))]
        ids = np.array([model.actuator(name).id for name in self.motors])
        starts = [0, *(np.flatnonzero(np.diff(ids) != 1) + 1), len(ids)]
        return [
            (slice(int(ids[a]), int(ids[a]) + int(b - a)), slice(int(a), int(b)))
            for a, b in pairwise(starts)
        ]


def motors(names: Iterable[str]) -> Input:
    """Return the motors of these names in ``ctrl``."""
    return Input("ctrl", tuple(names))


# The free joint comes first in qfrc_applied: force in inertial axes, then torque in body axes.
BUS_TORQUE = Input("qfrc_applied", columns=range(3, 6))
"""The torque on the bus [N m], body axes."""
DIPOLE = Input("userdata", columns=range(MOMENT.start, MOMENT.stop))
"""The vehicle's magnetic moment [A m^2], body axes, in the environment's field."""


def together(axes: Array, limits: Array) -> Array:
    """Return what a set with these unit ``axes`` (n, 3) and ``limits`` (n,) has about each, (3,).

    Infinite limits have no share where an axis has none.
    """
    shares = np.abs(axes)
    each = np.broadcast_to(limits[:, None], shares.shape)
    reach = np.multiply(shares, each, out=np.zeros_like(shares), where=shares > 0.0)
    total: Array = reach.sum(axis=0)
    return total


class Actuator(ABC):
    """One kind of actuator of a batch of vehicles; all memory is in ``State``.

    A subclass is a frozen dataclass. Arrays have the vehicle axis first, (N, ...).
    """

    logged_as: ClassVar[str]
    """The field of /command that what it applies is logged under."""
    unit: ClassVar[str]
    """Of that field."""
    measures: ClassVar[Mapping[str, str]] = {}
    """The fields of ``Measurement`` that ``measured`` fills in, with their units."""

    @property
    @abstractmethod
    def takes(self) -> Fields:
        """The fields of a command that it obeys."""

    @property
    @abstractmethod
    def drives(self) -> Input:
        """What it drives."""

    @property
    def stateful(self) -> bool:
        """Whether it must act in every integration step; else once in a control period."""
        return False

    def reset(self, vehicles: int) -> State:
        """Return its state at the start."""
        return {}

    def limits(self) -> Limits:
        """Return the least and the largest of each field that it takes, infinite where unlimited.

        They bound what can be applied; a command beyond them is not refused.
        """
        found = {}
        for name, (shape, _) in self.takes.items():
            largest = np.full(shape, np.inf)
            found[name] = (-largest, largest)
        return found

    @abstractmethod
    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, applied, saturated) for ``step`` [s] from now.

        ``applied`` (N, width) is held over the step in what it ``drives``; ``saturated``, (N,
        motors), is 1.0 for a motor that cannot follow its command, else 0.0.
        """

    def measured(self, state: State, truth: Measurement) -> Measurement:
        """Return the truth with what sensors of the actuator's own measure of it."""
        return truth

    def masses(self, before: State, after: State) -> dict[str, tuple[int, Array]]:
        """Return, for each field of MuJoCo's model that burning changes, the body and its values.

        They are the vehicles', (N, ...), in the middle of the integration step that leads from
        ``before`` to ``after``: with them a constant thrust gives Tsiolkovsky's velocity to second
        order.
        """
        return {}

    def account(
        self, state: State, applied: Array, instead: Array, step: float
    ) -> tuple[State, Array]:
        """Return (state, applied) where faults have made ``instead`` of what ``act`` applied."""
        return state, instead


@dataclass(frozen=True)
class Context:
    """What an actuator may know of the vehicle and the flight that it is built for."""

    vehicle: Vehicle
    driven: Driven
    """What its own table drives."""
    rates: Rates
    initial: Initial
    gravity: float = 0.0
    """Central gravity where the vehicle starts [m/s^2]; 0 without."""
    inner: bool = False
    """Whether the law's inner loop commands it, anew in every integration step."""
    before: tuple[Actuator, ...] = ()
    """The vehicle's actuators whose keys come before its own."""
    alone: bool = True
    """Whether the vehicle has no other actuator."""


class ActuatorTable(Equipment, ABC):
    """Base of an actuator's table in [plant]."""

    @abstractmethod
    def actuator(self, context: Context) -> Actuator:
        """Return the actuator.

        Raises:
            ValueError: it cannot be built.
        """

    def facts(self, vehicle: Vehicle) -> dict[str, Any]:
        """Return what a law that leaves out a gain of that name takes from the vehicle."""
        return {}
