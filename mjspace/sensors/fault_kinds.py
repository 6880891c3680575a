"""Kinds of fault of a sensor, or of the link from it: what each makes of a sample."""

from abc import ABC
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from mjspace.contract import Array
from mjspace.units import whole_number

PHASE = "fault_phase"
"""Where the faults' phases are remembered, (N, faults): 0 before, 1 in force, 2 over."""
IN_FORCE = 1.0
STREAM = 1000
"""First number of the faults' random streams; the sensors' are hashes of their names."""


class Sample(NamedTuple):
    """What a sensor reports of an instant."""

    values: Array
    """(N, width)."""
    valid: Array
    """1.0 or 0.0, (N, 1)."""


class SensorFault(Protocol):
    """What the sensors need to know of a fault's table."""

    sensor: str | None
    kind: str
    value: Any


class SensorFaultKind(ABC):
    """One kind of fault of a sensor. Nothing is changed by default."""

    applies: ClassVar[str]
    """What the sensor reports under it, for the scenario reference."""
    has_value: ClassVar[bool] = True
    """Whether it has a ``value``."""
    of_axes: ClassVar[bool] = False
    """Whether that may be one for each axis, in the unit of the sensor's errors."""
    per_second: ClassVar[bool] = False
    """Whether that unit is per second."""
    in_seconds: ClassVar[bool] = False
    """Whether it is a time."""
    is_positive: ClassVar[bool] = False
    """Whether it must be above zero."""
    is_probability: ClassVar[bool] = False
    """Whether it is one, and numbers are drawn with it."""

    def gain(self, value: float) -> float:
        """Return by what the white noise is multiplied."""
        return 1.0

    def offset(self, value: Array, since: Array) -> Any:
        """Return what is added to the error; it began ``since`` [s] ago, (N, 1)."""
        return None

    def result(self, sample: Sample, held: Array, nothing: Array, lost: Any) -> Sample:
        """Return what is reported instead of the ``sample``.

        ``held`` is what was reported last (N, width), ``nothing`` what a sensor without power
        reports (width,), ``lost`` where a sample is (N, 1).
        """
        return sample

    def late(self, value: float, period: float, key: str) -> int:
        """Return how many sample ``period``s [s] later its samples arrive.

        Raises:
            ValueError: that is no whole number; ``key`` is the value's in the scenario.
        """
        return 0


class Dead(SensorFaultKind):
    """A sensor without power."""

    applies = "zeros, or no rotation; not valid"
    has_value = False

    def result(self, sample: Sample, held: Array, nothing: Array, lost: Any) -> Sample:
        """Return zeros."""
        return Sample(np.where(sample.valid > -1.0, nothing, sample.values), sample.valid * 0.0)


class Stuck(SensorFaultKind):
    """A sensor whose report does not change, and that does not notice it."""

    applies = "what it reported before"
    has_value = False

    def result(self, sample: Sample, held: Array, nothing: Array, lost: Any) -> Sample:
        """Return what was reported last."""
        return Sample(held, sample.valid)


class Biased(SensorFaultKind):
    """A step of the bias."""

    applies = "``value`` more"
    of_axes = True

    def offset(self, value: Array, since: Array) -> Any:
        """Return the step."""
        return value


class Drifting(SensorFaultKind):
    """A ramp of the bias."""

    applies = "``value`` times the seconds since more"
    of_axes = True
    per_second = True

    def offset(self, value: Array, since: Array) -> Any:
        """Return the ramp."""
        return value * since


class Noisy(SensorFaultKind):
    """A sensor whose white noise has grown."""

    applies = "``value`` times its white noise"
    is_positive = True

    def gain(self, value: float) -> float:
        """Return the factor."""
        return value


class Dropping(SensorFaultKind):
    """A link that loses samples."""

    applies = "its last sample, not valid, with the probability ``value``"
    is_probability = True

    def result(self, sample: Sample, held: Array, nothing: Array, lost: Any) -> Sample:
        """Return what was reported last where a sample is lost."""
        return Sample(
            np.where(lost, held, sample.values), np.where(lost, sample.valid * 0.0, sample.valid)
        )


class Delayed(SensorFaultKind):
    """A link that has become slow."""

    applies = "what it would have reported ``value`` seconds before"
    is_positive = True
    in_seconds = True

    def late(self, value: float, period: float, key: str) -> int:
        """Return the delay in samples."""
        return whole_number(value, period, key, "the sensor's period")


KINDS: dict[str, SensorFaultKind] = {
    "dead": Dead(),
    "stuck": Stuck(),
    "biased": Biased(),
    "drifting": Drifting(),
    "noisy": Noisy(),
    "dropping": Dropping(),
    "delayed": Delayed(),
}
"""By the name in a scenario: a line registers each."""


def of_sensor(name: str, tables: Sequence[Any]) -> list[tuple[int, SensorFault]]:
    """Return the faults of the sensor of that ``name``, with their numbers in the scenario."""
    return [(number, each) for number, each in enumerate(tables) if each.sensor == name]
