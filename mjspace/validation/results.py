"""The results of ``mjspace validate`` as data: written to JSON, and input of the report's pages."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, computed_field

from mjspace.validation.benchmark import Bound, Curve, Fault, Integrator

Number = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]
"""A number that is null in JSON where it is NaN."""


class Data(BaseModel):
    """Frozen data; unknown and computed fields are ignored on reading."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class Row(Data):
    """A quantity measured with RK4, its verdict, and its values with the other integrators."""

    quantity: str
    unit: str
    measured: Number
    target: float
    allowed: float
    reason: str
    passed: bool
    others: dict[Integrator, Number] = {}

    @staticmethod
    def judged(
        bound: Bound, measured: float, others: Mapping[Integrator, float] = MappingProxyType({})
    ) -> "Row":
        """Return the measured value with the verdict of its bound."""
        return Row(
            quantity=bound.quantity,
            unit=bound.unit,
            measured=measured,
            target=bound.target,
            allowed=bound.allowed,
            reason=bound.reason,
            passed=bound.admits(measured),
            others=dict(others),
        )


class Injected(Data):
    """The result of an injected fault."""

    fault: Fault
    meaning: str
    expected: bool
    """Whether the benchmark claims to detect it."""
    broken: list[str]
    """The quantities that left their bounds."""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def caught(self) -> bool:
        """Whether the benchmark detected it."""
        return bool(self.broken)


class Line(Data):
    """A curve of a figure, or dots."""

    label: str
    x: list[Number]
    y: list[Number]
    dots: bool = False

    @staticmethod
    def of(curve: Curve) -> "Line":
        """Return a curve rounded to six digits, enough for a figure."""
        x, y = ([float(f"{value:.6g}") for value in values] for values in (curve.x, curve.y))
        return Line(label=curve.label, x=x, y=y, dots=curve.dots)


class Section(Data):
    """A benchmark's results."""

    name: str
    title: str
    shows: str
    source: str
    step: float  # s
    rows: list[Row]
    faults: list[Injected]
    x_label: str
    y_label: str
    motion: list[Line]
    error_label: str
    errors: dict[Integrator, Line]

    @computed_field  # type: ignore[prop-decorator]
    @property
    def passed(self) -> bool:
        """Whether every bound held and every expected fault was detected."""
        return all(row.passed for row in self.rows) and not self.missed

    @property
    def missed(self) -> list[Injected]:
        """The faults that the benchmark claims to detect and did not."""
        return [injected for injected in self.faults if injected.expected and not injected.broken]


class Results(Data):
    """Results of one run of the suite; reproducible on one machine."""

    versions: dict[str, str]
    quick: bool
    sections: list[Section]
    remarks: list[str] = []
    """Parts that were left out, with the reason."""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def passed(self) -> bool:
        """Whether every section passed."""
        return all(section.passed for section in self.sections)
