"""The kinds of value that a scenario's keys hold: SI numbers, vectors and frozen tables."""

import importlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationError,
    ValidationInfo,
)
from pydantic_core import core_schema

from mjspace.ranges import FORMS, Form
from mjspace.units import to_si

_IN_PEOPLES_UNITS = {"rad": "deg", "rad/s": "deg/s", "m": "km", "s": "min"}


@dataclass(frozen=True)
class Si:
    """Marks a number, or a list of them, as held in one SI unit: quantity strings are converted."""

    unit: str

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Convert before anything else looks at the value."""
        return core_schema.no_info_wrap_validator_function(self._validated, handler(source))

    def _validated(self, value: Any, inner: core_schema.ValidatorFunctionWrapHandler) -> Any:
        """Return the value in SI; one out of range is suspected to have been meant in degrees."""
        try:
            return inner(to_si(value, self.unit))
        except ValidationError as error:
            if isinstance(value, str | bool) or not isinstance(value, int | float):
                raise
            meant = f"{value:g} {_IN_PEOPLES_UNITS.get(self.unit, '')}"
            try:
                inner(to_si(meant, self.unit))
            except ValueError:
                raise error from None
            wrong = error.errors()[0]["msg"].replace("Input should", "should")
            raise ValueError(
                f"got {value:g} {self.unit}, {wrong}: did you mean {meant!r}?"
            ) from None

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Add the unit, for the scenario reference."""
        return {**handler(schema), "unit": self.unit}


@dataclass(frozen=True)
class DeclaredIn:
    """Marks a key whose table is a class in the file of the part that it describes.

    ``Annotated[Any, DeclaredIn("mjspace.environment.orbit:Orbit")]``: the class is imported when
    pydantic first builds the schema, so that this room imports none of those above it.
    """

    place: str
    """``"module:Class"``."""

    def load(self) -> type[BaseModel]:
        """Return the class."""
        module, _, name = self.place.partition(":")
        found: type[BaseModel] = getattr(importlib.import_module(module), name)
        return found

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Validate by the class."""
        return handler.generate_schema(self.load())


def tables_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the tables that a field's annotation names, those marked ``DeclaredIn`` too."""
    if isinstance(annotation, DeclaredIn):
        yield annotation.load()
    elif isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    else:
        for part in get_args(annotation):
            yield from tables_in(part)


def of_form(form: Form) -> AfterValidator:
    """Return what refuses an array that is not of that form."""

    def validated(rows: list[Any], info: ValidationInfo) -> list[Any]:
        if (info.context or {}).get("flown"):
            return rows  # an older log's, which were normalized
        if complaint := FORMS[form](np.array(rows, dtype=float)):
            raise ValueError(complaint)
        return rows

    return AfterValidator(validated)


Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, strict=True, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, strict=True, allow_inf_nan=False)]
Switch = Annotated[bool, Field(strict=True)]
Count = Annotated[int, Field(ge=0, strict=True)]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
Triple = Annotated[list[Finite], Field(min_length=3, max_length=3)]

Seconds = Annotated[Positive, Si("s")]
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


class Table(BaseModel):
    """A TOML table: frozen, and with no key that is not listed."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, use_attribute_docstrings=True, defer_build=True
    )
