"""Dispersions: which numbers of a scenario differ from member to member of a campaign, and how."""

import re
from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self

import numpy as np
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
ROUNDING = 1e-12
"""Of a correlation, by which an eigenvalue may be below zero."""
_NOT_FLOWN = ("checks", "dispersions", "events", "log", "sampling", "seed", "task")
_Number = Annotated[Finite, AnyUnit]


class Dispersion(Table):
    """One number, vector or set of numbers of the scenario that each member of a campaign draws."""

    key: str | None = None
    """Of the scenario, as ``--set`` takes it; an element of a list by its index:
    ``"initial.rate[0]"``."""
    keys: Annotated[list[str], Field(min_length=2)] | None = None
    """In place of ``key``: numbers that are drawn together, ``normal`` about their own values, with
    a ``covariance``."""
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
    covariance: list[list[Finite]] | None = None
    """Of ``keys``, in SI: a row for each, symmetric and positive semidefinite."""
    radius: Annotated[NonNegative, AnyUnit] | None = None
    """Length of the vector of ``on_sphere``."""

    @field_validator("key")
    @classmethod
    def _a_key(cls, key: str | None) -> str | None:
        if key is not None:
            path_of(key)
        return key

    @field_validator("keys")
    @classmethod
    def _several_keys(cls, keys: list[str] | None) -> list[str] | None:
        for key in keys or ():
            path_of(key)
        return keys

    @field_serializer("values")
    def _plain(self, values: Any) -> Any:
        # Pydantic warns of quantities in a list.
        return values if values is None else [float(value) for value in values]

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if (self.key is None) == (self.keys is None):
            raise ValueError("key: give one, or keys with a covariance")
        if self.keys is not None or self.covariance is not None:
            self._fits_together()
            return self
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

    def _fits_together(self) -> None:
        if self.covariance is None:
            raise ValueError("covariance: missing, keys need it")
        if self.keys is None or self.distribution != "normal":
            raise ValueError('covariance: goes with keys and distribution = "normal"')
        for name in _PARAMETERS:
            if getattr(self, name) is not None:
                raise ValueError(f"{name}: keys take a covariance alone")
        count = len(self.keys)
        sizes = [len(row) for row in self.covariance]
        if sizes != [count] * count:
            shape = f"{len(sizes)} rows of {', '.join(map(str, dict.fromkeys(sizes)))}"
            raise ValueError(f"covariance: {shape} numbers, should be {count} by {count}")
        table = np.array(self.covariance)
        for i, j in zip(*np.nonzero(table != table.T), strict=True):
            raise ValueError(
                f"covariance: not symmetric: [{i}][{j}] is {table[i, j]:g}, "
                f"[{j}][{i}] is {table[j, i]:g}"
            )
        scale = np.sqrt(np.abs(np.diag(table)))
        scale[scale == 0.0] = 1.0
        least = float(np.linalg.eigvalsh(table / np.outer(scale, scale))[0])
        if np.any(np.diag(table) < 0.0) or least < -ROUNDING * count:
            raise ValueError(
                "covariance: not positive semidefinite: the least eigenvalue of the correlations "
                f"is {least:.3g}"
            )

    @property
    def name(self) -> str:
        """The key, or all keys of a set, as a person reads them."""
        return ", ".join(self.all_keys)

    @property
    def all_keys(self) -> list[str]:
        """The keys of what it draws."""
        return [self.key] if self.key is not None else list(self.keys or ())

    @property
    def paths(self) -> list[tuple[str, ...]]:
        """Each key's parts, an index as its digits."""
        return [path_of(key) for key in self.all_keys]

    def by_key(self, value: Any) -> dict[str, Any]:
        """Return what was drawn, by key."""
        return dict(zip(self.all_keys, [value] if self.keys is None else value, strict=True))


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
    earlier: list[str] = []
    for number, dispersion in enumerate(dispersions):
        for key in dispersion.all_keys:
            for other in earlier:
                one, two = path_of(key), path_of(other)
                shorter = min(len(one), len(two))
                if one[:shorter] == two[:shorter]:
                    place = "key" if dispersion.keys is None else "keys"
                    raise ValueError(
                        f"dispersions.{number}.{place}: {key!r} and {other!r} set the same number"
                    )
            earlier.append(key)
