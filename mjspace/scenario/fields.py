"""The kinds of value that a scenario's keys hold: SI numbers, vectors and frozen tables."""

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from types import GenericAlias
from typing import Annotated, Any

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
)
from pydantic_core import core_schema

from mjspace.contract import Array
from mjspace.errors import is_file_name, shortened
from mjspace.ranges import FORMS, Form
from mjspace.scenario.trust import CommandLineText
from mjspace.units import Quantity, Unit, quantity, to_si

_IN_PEOPLES_UNITS = {"rad": "deg", "rad/s": "deg/s", "m": "km", "s": "min"}


@dataclass(frozen=True)
class Si(Unit):
    """The SI unit of a scenario's number, or list of numbers: quantity strings are converted."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Convert before anything else looks at the value."""
        return core_schema.no_info_wrap_validator_function(self._validated, handler(source))

    def _validated(self, value: Any, inner: core_schema.ValidatorFunctionWrapHandler) -> Any:
        """Return the value in SI; one out of range is suspected to have been meant in degrees."""
        try:
            return inner(to_si(value, self.si))
        except ValidationError as error:
            if isinstance(value, str | bool) or not isinstance(value, int | float):
                raise
            meant = f"{value:g} {_IN_PEOPLES_UNITS.get(self.si, '')}"
            try:
                inner(to_si(meant, self.si))
            except ValueError:
                raise error from None
            wrong = error.errors()[0]["msg"].replace("Input should", "should")
            raise ValueError(f"got {value:g} {self.si}, {wrong}: did you mean {meant!r}?") from None

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Add the unit, for the scenario reference."""
        return {**handler(schema), "unit": self.si}


@dataclass(frozen=True)
class Interval(Si):
    """A period [s]; a frequency does too: ``"100 Hz"`` is 0.01 s."""

    def _validated(self, value: Any, inner: core_schema.ValidatorFunctionWrapHandler) -> Any:
        if isinstance(value, str) and (found := quantity(value, "s", "Hz")).unit == "Hz":
            if found <= 0.0:
                raise ValueError(f"got {value!r}, should be greater than 0")
            value = 1.0 / found
        return super()._validated(value, inner)


@dataclass(frozen=True)
class Walk(Si):
    """A random walk's deviation after one second; of a rate of walk, its number is the same."""

    def _validated(self, value: Any, inner: core_schema.ValidatorFunctionWrapHandler) -> Any:
        if isinstance(value, str) and self.si:
            value = quantity(value, self.si, f"{self.si}/sqrt(s)")
        return super()._validated(value, inner)


@dataclass(frozen=True)
class OneOrEach:
    """A number for all of a set, or a list with one for each."""

    kind: Any
    """The type of each."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Validate a single number as a list of one."""
        each = handler.generate_schema(GenericAlias(list, (self.kind,)))
        return core_schema.no_info_wrap_validator_function(
            self._validated, each, serialization=core_schema.simple_ser_schema("any")
        )

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Return that it is a number or a list of such numbers."""
        listed = handler(schema)
        return {"anyOf": [listed["items"], listed]}

    def _validated(self, value: Any, inner: core_schema.ValidatorFunctionWrapHandler) -> Any:
        if isinstance(value, list):
            return inner(value)
        try:
            return inner([value])[0]
        except ValidationError as error:
            detail = error.errors()[0]
            if isinstance(cause := detail.get("ctx", {}).get("error"), ValueError):
                raise cause from None  # which says what was given
            wrong = detail["msg"].replace("Input should", "should")
            raise ValueError(f"got {shortened(repr(value))}, {wrong}") from None


def of_form(form: Form) -> AfterValidator:
    """Return what refuses an array that is not of that form."""

    def validated(rows: list[Any], info: ValidationInfo) -> list[Any]:
        if (info.context or {}).get("flown"):
            return rows  # an older log's, which were normalized
        if complaint := FORMS[form](np.array(rows, dtype=float)):
            raise ValueError(complaint)
        return rows

    return AfterValidator(validated)


def _file_name(name: str) -> str:
    if not is_file_name(name):
        raise ValueError(f"got {shortened(name)!r}, should be a name that a folder can have")
    return name


def _written_out(epoch: Any) -> Any:
    if isinstance(epoch, int | float) or (isinstance(epoch, str) and "-" not in epoch):
        raise ValueError(f"got {epoch!r}, should be a date as in 2025-01-01T12:00:00")
    return epoch


def _universal(epoch: datetime) -> datetime:
    return epoch.astimezone(UTC).replace(tzinfo=None) if epoch.tzinfo else epoch


def _marked(name: Any, inner: ValidatorFunctionWrapHandler) -> Any:
    return name if isinstance(name, CommandLineText) else inner(name)


def _in_any_unit(value: Any, inner: ValidatorFunctionWrapHandler) -> Any:
    found = to_si(value, None)
    number = inner(found)
    return found if isinstance(found, Quantity) else number


AnyUnit = WrapValidator(_in_any_unit)
"""Of a number in SI, or a ``Quantity`` whose unit is judged where it is known which is right."""
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, strict=True, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, strict=True, allow_inf_nan=False)]
Switch = Annotated[bool, Field(strict=True)]
Epoch = Annotated[datetime, BeforeValidator(_written_out), AfterValidator(_universal)]
"""A date and time, UTC where it says no other, kept without a time zone."""
Count = Annotated[int, Field(ge=0, strict=True)]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
SensorName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
"""A field of the measurement: a sensor of one's own model keeps its capitals."""
JointName = Annotated[str, Field(min_length=1)]
"""As the model has it: of one's own it may be any text."""
KindName = Annotated[str, WrapValidator(_marked)]
"""What names code. It stays marked as text of the command line."""
FileName = Annotated[str, AfterValidator(_file_name)]
Triple = Annotated[list[Finite], Field(min_length=3, max_length=3)]

Each = Annotated[float | list[Positive], OneOrEach(Positive)]
"""Of each of a set: wheels, coils, ....  With its unit behind: ``Annotated[Each, Si("kg")]``."""
EachNonNegative = Annotated[float | list[NonNegative], OneOrEach(NonNegative)]
"""Likewise, of what may be zero."""
Seconds = Annotated[Positive, Si("s")]
Period = Annotated[Positive, Field(ge=1e-9), Si("s")]
"""From one instant to another: a log's clock has nanoseconds, in 64 bits."""
Time = Annotated[NonNegative, Si("s")]
Angle = Annotated[Finite, Si("rad")]
TWO_TURNS = Field(ge=-2.0 * math.pi, le=2.0 * math.pi)
WithinTurn = Annotated[Finite, TWO_TURNS, Si("rad")]
"""An angle of a place or a direction: at most one turn either way."""
Unit3 = Annotated[Triple, of_form("direction"), Si("")]
Meters3 = Annotated[Triple, Si("m")]
Velocity3 = Annotated[Triple, Si("m/s")]
Rate3 = Annotated[Triple, Si("rad/s")]
Angles3 = Annotated[
    list[Annotated[Finite, TWO_TURNS]], Field(min_length=3, max_length=3), Si("rad")
]
Torque3 = Annotated[Triple, Si("N m")]
Momentum3 = Annotated[Triple, Si("N m s")]
Quaternion = Annotated[
    list[Finite], Field(min_length=4, max_length=4), of_form("quaternion"), Si("")
]
Matrix3 = Annotated[
    list[Annotated[Triple, Si("kg m^2")]],
    Field(min_length=3, max_length=3),
    of_form("inertia"),
]


def of_each(value: Any, count: int) -> Array:
    """Return the numbers of each of ``count``, shape (count,), of one for all or one for each."""
    return np.broadcast_to(value, count).astype(float)


def refuse_other_count(key: str, value: Any, count: int, rows: str) -> None:
    """Refuse a list with another length than the set has.

    Raises:
        ValueError: with the ``key``; ``rows`` is the key of what there are ``count`` of.
    """
    if isinstance(value, list) and len(value) != count:
        raise ValueError(f"{key}: {len(value)} numbers for {count} {rows}: give one, or as many")


class Table(BaseModel):
    """A TOML table: frozen, and with no key that is not listed."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)
