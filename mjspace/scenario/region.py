"""Regions of a signal: the values between bounds."""

from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from mjspace.contract import Array
from mjspace.scenario.fields import AnyUnit, Finite, Table


class Region(Table):
    """Where a signal has to be."""

    signal: str
    """``topic.field`` or ``topic.field[i]`` of the log: ``truth.attitude_error``; of a vector its
    norm."""
    below: Annotated[Finite, AnyUnit] | None = None
    """It must be less; a number in SI or a quantity."""
    above: Annotated[Finite, AnyUnit] | None = None
    """It must be greater; a number in SI or a quantity."""

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        if self.below is None and self.above is None:
            raise ValueError("neither below nor above is given: a region must have an outside")
        if self.below is not None and self.above is not None and self.below <= self.above:
            raise ValueError(
                f"below {self.below:g} and above {self.above:g}: nothing is inside, "
                "below should be the larger"
            )
        return self

    def admits(self, value: Array | float) -> NDArray[np.bool_]:
        """Return whether each value is inside; what is no number never is."""
        return admitted(value, self.below, self.above)


def admitted(value: Array | float, below: float | None, above: float | None) -> NDArray[np.bool_]:
    """Return whether each value is between the bounds; what is no number never is."""
    less = True if below is None else np.less(value, below)
    greater = True if above is None else np.greater(value, above)
    return np.logical_and(less, greater)
