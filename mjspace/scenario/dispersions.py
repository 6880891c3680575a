"""Dispersions: which numbers of a scenario differ from member to member of a campaign, and how."""

import re
from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_serializer, field_validator, model_validator

from mjspace.scenario.fields import AnyUnit, Finite, NonNegative, Table
from mjspace.units import Quantity

REQUIRED = {
    "normal": ("std",),
    "uniform": ("low", "high"),
    "log_uniform": ("low", "high"),
    "triangular": ("low", "high"),
    "discrete": ("values",),
    "random_attitude": (),
    "on_sphere": ("radius",),
}
"""What each distribution must be given."""
OPTIONAL = {"normal": ("mean",), "triangular": ("mode",)}
"""What it may be given: the scenario's own value when left out."""
_PARAMETERS = ("mean", "std", "low", "high", "mode", "values", "radius")
_NOT_FLOWN = ("checks", "dispersions", "events", "log", "sampling", "seed", "task")
_Number = Annotated[Finite, AnyUnit]


class Dispersion(Table):
    """One number, or vector, of the scenario that is drawn for each member of a campaign."""

    key: str
    """Of the scenario, as ``--set`` takes it; an element of a list by its index:
    ``"initial.rate[0]"``."""
    distribution: Literal[
        "normal",
        "uniform",
        "log_uniform",
        "triangular",
        "discrete",
        "random_attitude",
        "on_sphere",
    ]
    """Its parameters are in SI or quantities. ``random_attitude`` is a quaternion, evenly
    distributed over all rotations; ``on_sphere`` a vector of length ``radius`` in any direction."""
    mean: _Number | None = None
    """Of ``normal``; the scenario's own value when left out."""
    std: Annotated[NonNegative, AnyUnit] | None = None
    """Standard deviation of ``normal``."""
    low: _Number | None = None
    """Least value of ``uniform``, ``log_uniform`` (then greater than 0) and ``triangular``."""
    high: _Number | None = None
    """Largest value, greater than ``low``."""
    mode: _Number | None = None
    """Most likely value of ``triangular``; the scenario's own value when left out."""
    values: Annotated[list[_Number], Field(min_length=1)] | None = None
    """Of ``discrete``: numbers in SI or quantities, each as likely as the others."""
    radius: Annotated[NonNegative, AnyUnit] | None = None
    """Length of the vector of ``on_sphere``."""

    @field_validator("key")
    @classmethod
    def _a_key(cls, key: str) -> str:
        path_of(key)
        return key

    @field_serializer("values")
    def _plain(self, values: Any) -> Any:
        # Pydantic warns of quantities in a list.
        return values if values is None else [float(value) for value in values]

    @model_validator(mode="after")
    def _fits(self) -> Self:
        required = REQUIRED[self.distribution]
        takes = (*required, *OPTIONAL.get(self.distribution, ()))
        for name in required:
            if getattr(self, name) is None:
                raise ValueError(f"{name}: missing, {self.distribution} needs it")
        for name in _PARAMETERS:
            if name not in takes and getattr(self, name) is not None:
                words = ", ".join(takes) or "no parameter"
                raise ValueError(f"{name}: {self.distribution} takes {words}")
        if self.low is not None and self.high is not None and not self.low < self.high:
            raise ValueError(f"low {self.low:g} should be less than high {self.high:g}")
        if self.distribution == "log_uniform" and self.low is not None and not self.low > 0.0:
            raise ValueError(f"low: got {self.low:g}, should be greater than 0")
        refuse_mode_outside(self, self.mode)
        if len(units := {each.unit for each in self.quantities}) > 1:
            raise ValueError(f"its parameters have different units: {', '.join(sorted(units))}")
        return self

    @property
    def quantities(self) -> list[Quantity]:
        """Its parameters that were written with a unit."""
        given = [getattr(self, name) for name in _PARAMETERS if name != "values"]
        return [each for each in (*given, *(self.values or ())) if isinstance(each, Quantity)]

    @property
    def path(self) -> tuple[str, ...]:
        """The key's parts, an index as its digits."""
        return path_of(self.key)


def path_of(key: str) -> tuple[str, ...]:
    """Return the parts of a scenario's ``key``, an index as its digits.

    Raises:
        ValueError: it is none, or of nothing that flies.
    """
    if re.fullmatch(r"[^\s.\[\]=]+(\.[^\s.\[\]=]+|\[\d+\])*", key) is None:
        raise ValueError(f"got {key!r}, should be as 'plant.mass' or 'initial.rate[0]'")
    path = tuple(re.split(r"[.\[]", key.replace("]", "")))
    if path[0] in _NOT_FLOWN:
        raise ValueError(f"{key!r} is no part of the flight")
    return path


def refuse_mode_outside(dispersion: Dispersion, mode: float | None) -> None:
    """Refuse a most likely value of a triangular distribution that is not between its ends.

    Raises:
        ValueError: with the value and the ends.
    """
    low, high = dispersion.low, dispersion.high
    if dispersion.distribution != "triangular" or mode is None or low is None or high is None:
        return
    if not low <= mode <= high:
        raise ValueError(f"mode {mode:g} should be from low {low:g} to high {high:g}")


def refuse_overlaps(dispersions: Sequence[Dispersion]) -> None:
    """Refuse two dispersions of which one would overwrite the other.

    Raises:
        ValueError: with both keys.
    """
    for number, one in enumerate(dispersions):
        for other in dispersions[:number]:
            shorter = min(len(one.path), len(other.path))
            if one.path[:shorter] == other.path[:shorter]:
                raise ValueError(
                    f"dispersions.{number}.key: {one.key!r} and {other.key!r} set the same number"
                )
