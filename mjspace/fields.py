"""The kinds of value that a scenario's keys hold: SI numbers, vectors and frozen tables."""

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import core_schema

from mjspace.quantity import to_si


@dataclass(frozen=True)
class Si:
    """Marks a number, or a list of them, as held in one SI unit: quantity strings are converted."""

    unit: str

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Convert before anything else looks at the value."""
        return core_schema.no_info_before_validator_function(
            lambda value: to_si(value, self.unit), handler(source)
        )

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Add the unit, for the scenario reference."""
        return {**handler(schema), "unit": self.unit}


Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
Triple = Annotated[list[Finite], Field(min_length=3, max_length=3)]

Seconds = Annotated[Positive, Si("s")]
Time = Annotated[NonNegative, Si("s")]
Angle = Annotated[Finite, Si("rad")]
Unit3 = Annotated[Triple, Si("")]
Meters3 = Annotated[Triple, Si("m")]
Velocity3 = Annotated[Triple, Si("m/s")]
Rate3 = Annotated[Triple, Si("rad/s")]
Angles3 = Annotated[Triple, Si("rad")]
Torque3 = Annotated[Triple, Si("N m")]
Momentum3 = Annotated[Triple, Si("N m s")]
Quaternion = Annotated[list[Finite], Field(min_length=4, max_length=4)]
Matrix3 = Annotated[list[Annotated[Triple, Si("kg m^2")]], Field(min_length=3, max_length=3)]


class Table(BaseModel):
    """A TOML table: frozen, and with no key that is not listed."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)
