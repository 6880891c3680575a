"""What ``mjspace validate`` found out, as data: written to JSON, read by the report's pages."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, computed_field

from mjspace.validation.benchmark import Bound, Curve, Fault, Integrator

Number = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]
"""JSON has no NaN: null stands for it."""


class Data(BaseModel):
    """Plain data that does not change; what is computed is ignored when it is read."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class Row(Data):
    """A quantity, measured under RK4 and judged, and what the other integrators make of it."""

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
        """Return what was measured with the bound's verdict on it."""
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
    """What became of an injected fault."""

    fault: Fault
    meaning: str
    wanted: bool
    """Whether the benchmark claims to catch it."""
    broken: list[str]
    """The quantities that it put out of bounds."""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def caught(self) -> bool:
        """Whether the benchmark failed with it, as it should."""
        return bool(self.broken)


class Line(Data):
    """A curve of a figure, or dots."""

    label: str
    x: list[Number]
    y: list[Number]
    dots: bool = False

    @staticmethod
    def of(curve: Curve) -> "Line":
        """Return a curve with six digits, as much as a figure can show."""
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
        """Whether every bound held, and every fault that should be caught was."""
        return all(row.passed for row in self.rows) and not self.missed

    @property
    def missed(self) -> list[Injected]:
        """The faults that the benchmark claims to catch and did not."""
        return [injected for injected in self.faults if injected.wanted and not injected.broken]


class Results(Data):
    """Everything that one run of the suite found; the same from run to run on one machine."""

    versions: dict[str, str]
    quick: bool
    sections: list[Section]
    remarks: list[str] = []
    """What was left out, and why."""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def passed(self) -> bool:
        """Whether everything did."""
        return all(section.passed for section in self.sections)
