"""The bases of the tables of parts that are bolted to a vehicle's bus."""

from abc import abstractmethod
from typing import Any, NamedTuple

from mjspace.scenario.fields import Angles3, Meters3, Table


class Mounted(Table):
    """Where a part is bolted to the bus."""

    position: Meters3 = [0.0, 0.0, 0.0]
    """Of its origin in the bus."""
    euler: Angles3 = [0.0, 0.0, 0.0]
    """Roll, pitch, yaw of its axes in the bus's."""


class Report(NamedTuple):
    """A field of /truth that tells how a part moves; names are without the part's."""

    field: str
    unit: str
    sensor: str
    """Of the model, the first that it is read from."""
    numbers: slice
    """Which numbers it has, counted from the first of that sensor."""


class MovingPart(Mounted):
    """Base of a kind of part that moves on the bus without a motor and is built by its table."""

    @abstractmethod
    def build(self) -> Any:
        """Return the part's ``MjSpec``, its axes those of the world body."""

    @abstractmethod
    def reports(self) -> tuple[Report, ...]:
        """Return what the log has of its motion."""
