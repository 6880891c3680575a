"""Instruments that report vectors or numbers: scale factors, axes that are off, and a range."""

from collections.abc import Mapping
from typing import Annotated, Any, Generic

import numpy as np
from pydantic import Field

from mjspace import algebra, attitude
from mjspace.contract import Array
from mjspace.scenario.fields import Angles3, Finite, NonNegative, OneOrEach, Si, of_each
from mjspace.scenario.fields import refuse_other_count as refuse
from mjspace.sensors.base import Density, Deviation, Draw, Known, Limit, Sensor, WalkDeviation

_Deviation = Annotated[NonNegative, Field(le=0.1), Si("rad")]
_SmallAngles = Annotated[
    list[Annotated[Finite, Field(ge=-0.2, le=0.2)]], Field(min_length=3, max_length=3), Si("rad")
]


class Linear(
    Sensor[Deviation, Known, WalkDeviation, Density, Limit],
    Generic[Deviation, Known, WalkDeviation, Density, Limit],
):
    """An instrument with a scale factor on each axis, and a range."""

    scale_factor: Annotated[float | list[Finite], OneOrEach(Finite), Si("")] = 0.0
    """Error of the scale factor that is known, 1e-6 for 1 ppm: of all axes, or of each."""
    scale_factor_std: Annotated[NonNegative, Si("")] = 0.0
    """Standard deviation of that error as drawn at the start, on each axis."""
    range: Limit | None = None
    """Largest magnitude of what each axis reports: it saturates there."""

    @property
    def errors(self) -> tuple[str, ...]:
        """The keys of what makes a sample differ from the true value."""
        limited = () if self.range is None else ("range",)
        return (*super().errors, "scale_factor", "scale_factor_std", *limited)

    def fixed(self, draw: Draw, name: str, axes: int) -> dict[str, Array]:
        """Return "bias", and "gain" where an axis has another than 1, both (N, axes)."""
        refuse(f"sensors.{name}.scale_factor", self.scale_factor, axes, "axes")
        found = super().fixed(draw, name, axes)
        if np.any(self.scale_factor) or self.scale_factor_std:
            error = of_each(self.scale_factor, axes)
            found["gain"] = 1.0 + error + self.scale_factor_std * draw("scale_factor", axes)
        return found

    def deformed(self, value: Array, fixed: Mapping[str, Array]) -> Array:
        """Return the ``value`` times the gains."""
        return value * fixed["gain"] if "gain" in fixed else value

    def with_error(self, value: Array, error: Array) -> Array:
        """Return the sum of both within the range, as a whole number of digits."""
        result = value + error
        largest: Any = self.range
        return self.rounded(result if largest is None else np.clip(result, -largest, largest))


class Triad(
    Linear[Deviation, Known, WalkDeviation, Density, Limit],
    Generic[Deviation, Known, WalkDeviation, Density, Limit],
):
    """Three sensitive axes, nominally those of the body."""

    misalignment: Angles3 = Field(default=[0.0, 0.0, 0.0])
    """Rotation vector that turns the nominal axes into the instrument's."""
    misalignment_std: _Deviation = 0.0
    """Standard deviation of each of its components as drawn at the start, added to it."""
    non_orthogonality: _SmallAngles = Field(default=[0.0, 0.0, 0.0])
    """How far the y axis is turned towards x, and z towards x and towards y."""
    non_orthogonality_std: _Deviation = 0.0
    """Standard deviation of each of these as drawn at the start, added to it."""

    @property
    def errors(self) -> tuple[str, ...]:
        """The keys of what makes a sample differ from the true value."""
        return (*super().errors, *_OF_AXES)

    def fixed(self, draw: Draw, name: str, axes: int) -> dict[str, Array]:
        """Return as ``Linear``, and "axes" (N, 3, 3) where the axes are not the nominal ones.

        What an axis reports is the vector's component along it. Its rows are the sensitive axes in
        body axes, before the scale factors; no angle is taken for small.
        """
        found = super().fixed(draw, name, axes)
        if not any(np.any(getattr(self, key)) for key in _OF_AXES):
            return found
        skew = np.array(self.non_orthogonality) + self.non_orthogonality_std * draw(
            "non_orthogonality", 3
        )
        turn = np.array(self.misalignment) + self.misalignment_std * draw("misalignment", 3)
        sines = np.sin(skew)
        rows = np.zeros((len(sines), 3, 3))
        rows[:, 0, 0] = 1.0
        rows[:, 1, 0], rows[:, 1, 1] = sines[:, 0], np.cos(skew[:, 0])
        rows[:, 2, :2] = sines[:, 1:]
        rows[:, 2, 2] = np.sqrt(1.0 - sines[:, 1] ** 2 - sines[:, 2] ** 2)
        turned = attitude.to_matrix(attitude.from_rotation_vector(turn))
        return found | {"axes": algebra.matrix_product(rows, algebra.transpose(turned))}

    def deformed(self, value: Array, fixed: Mapping[str, Array]) -> Array:
        """Return the components along the instrument's axes, times the gains."""
        along = algebra.times(fixed["axes"], value) if "axes" in fixed else value
        return super().deformed(along, fixed)


_OF_AXES = ("misalignment", "misalignment_std", "non_orthogonality", "non_orthogonality_std")
