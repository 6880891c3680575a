"""What is measured of a flight: a statistic of a signal over a window of time."""

import math
from typing import Any, Self

import numpy as np
from pydantic import (
    ValidatorFunctionWrapHandler,
    field_serializer,
    field_validator,
    model_validator,
)

from mjspace.contract import TICK
from mjspace.ranges import numbers
from mjspace.scenario.fields import Switch, Table, Time
from mjspace.units import Quantity, to_si


class Measurement(Table):
    """A statistic of a signal over a window, on every control period."""

    statistic: str = "max"
    """Which statistic: what measures says which there are."""
    start: Time = 0.0
    """The window's first instant."""
    end: Time | None = None
    """The window's last instant; the flight's when left out."""
    since: str | None = None
    """Name of an event: the window's instants are counted from when it first happened."""
    until: str | None = None
    """Name of an event: the window ends before it first happened."""
    target: float | list[float] | None = None
    """Taken from the signal first, so that the statistic is of an error; numbers in SI or
    quantities."""
    relative: Switch = False
    """The error is divided by the norm of ``target``."""

    @field_validator("target", mode="wrap")
    @classmethod
    def _numbers(cls, value: Any, _: ValidatorFunctionWrapHandler) -> Any:
        if value is None:
            return None
        several = isinstance(value, list | tuple)
        items = to_si(value if several else [value], None)
        found = numbers(items)
        if found.ndim != 1 or not len(found) or not np.isfinite(found).all():
            raise ValueError(f"got {value!r}, should be a finite number or a list of them")
        kept = [each if isinstance(each, Quantity) else float(each) for each in items]
        return kept if several else kept[0]

    @field_serializer("target")
    def _in_si(self, target: Any) -> Any:
        # Pydantic warns of quantities in a list.
        return [float(each) for each in target] if isinstance(target, list) else target

    @model_validator(mode="after")
    def _of_an_error(self) -> Self:
        if self.relative and self.target is None:
            raise ValueError("relative: needs a target")
        if self.relative and not np.any(self.target):
            raise ValueError("relative: the target is zero, by which no error can be divided")
        return self

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.end is not None and self.end < self.start:
            raise ValueError(f"start: {self.start:g} s is after end, {self.end:g} s")
        return self

    def begins_too_late(self, duration: float) -> bool:
        """Return whether a flight of ``duration`` [s] ends before the window begins."""
        return self.start > duration + TICK

    def is_between_samples(self, period: float) -> bool:
        """Return whether the window lies between two instants of a log of that ``period`` [s]."""
        if self.end is None or self.since is not None:
            return False
        return math.floor((self.end + TICK) / period) * period < self.start - TICK
