"""Flat facets of the bus, on which the air and sunlight press."""

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from mjspace.contract import Array
from mjspace.scenario.fields import Meters3, NonNegative, Positive, Si, Table, Unit3

_Part = Annotated[NonNegative, Field(le=1)]


class Facet(Table):
    """A flat facet of the bus; what is behind another one is not shadowed by it."""

    area: Annotated[Positive, Si("m^2")]
    """Of one side."""
    normal: Unit3
    """Outward, body axes; normalized."""
    position: Meters3
    """Of its centre of pressure, body axes, from the bus's origin."""
    drag_coefficient: Positive = 2.2
    """About 2 to 2.5 in free-molecular flow."""
    specular: _Part = 0.0
    """Part of sunlight that is reflected as by a mirror."""
    diffuse: _Part = 0.0
    """Part of sunlight that is reflected in all directions, by Lambert's law. What is neither is
    absorbed."""

    @model_validator(mode="after")
    def _no_more_than_comes(self) -> Self:
        if (total := self.specular + self.diffuse) > 1.0 + 1e-12:
            raise ValueError(f"specular and diffuse: their sum is {total:.6g}, should be at most 1")
        return self

    @property
    def outward(self) -> Array:
        """The unit normal."""
        normal: Array = np.array(self.normal)
        return normal / np.linalg.norm(normal)
