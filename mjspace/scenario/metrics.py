"""Metrics: numbers that a flight is described by, beside the checks that it is judged by."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from mjspace.scenario.fields import AnyUnit, Finite, KindName
from mjspace.scenario.measurement import Measurement


class Metric(Measurement):
    """One number of a flight: a statistic of a signal, or what a function of the user's returns."""

    name: Annotated[str, Field(min_length=1)]
    """Of the column in a campaign's results."""
    signal: str | None = None
    """Whose statistic it is: ``topic.field`` or ``topic.field[i]`` of the log."""
    statistic: Literal["max", "min", "peak", "mean", "rms", "final", "drift", "time_inside"] = "max"
    """As in a check; or ``time_inside``, the seconds of the window in which the signal is between
    ``above`` and ``below``."""
    below: Annotated[Finite, AnyUnit] | None = None
    """Of ``time_inside``: the signal is less; a number in SI or a quantity."""
    above: Annotated[Finite, AnyUnit] | None = None
    """Of ``time_inside``: the signal is greater; a number in SI or a quantity."""
    function: KindName | None = None
    """``"file.py:function"`` in the scenario's folder: in place of a signal, the metric is what
    ``function(time, signals)`` returns of the window's samples."""
    signals: list[str] = []
    """What the function receives, by these names."""

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.signal is None) == (self.function is None):
            raise ValueError("signal: give one, or a function of signals")
        if self.function is None and self.signals:
            raise ValueError("signals: go with a function")
        if self.function is not None:
            if not self.signals:
                raise ValueError("signals: missing, what the function is to receive")
            if self.statistic != "max" or self.target is not None:
                raise ValueError("statistic and target go with a signal, not with a function")
        return self

    @model_validator(mode="after")
    def _a_region(self) -> Self:
        bounds = [each for each in (self.below, self.above) if each is not None]
        if bool(bounds) != (self.statistic == "time_inside"):
            raise ValueError("statistic: 'time_inside' needs below or above, and no other has them")
        if self.below is not None and self.above is not None and self.below <= self.above:
            raise ValueError(
                f"below {self.below:g} and above {self.above:g}: nothing is inside, "
                "below should be the larger"
            )
        return self
