"""Tables that are declared in the file of the part that they describe, imported when needed."""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from types import GenericAlias
from typing import Any, get_args, get_origin

from pydantic import BaseModel, GetCoreSchemaHandler, RootModel
from pydantic.fields import FieldInfo
from pydantic_core import core_schema


@dataclass(frozen=True)
class DeclaredIn:
    """Marks a key whose table is declared in another file, imported when a scenario has the key.

    A scenario can so name the tables of rooms that build on it.
    """

    place: str
    """``"package.module:Class"``."""
    optional: bool = True
    """Whether the key may hold None: nothing of the kind is fitted."""

    @property
    def table(self) -> type[BaseModel]:
        """The class of the table."""
        module, _, name = self.place.partition(":")
        found: type[BaseModel] = getattr(import_module(module), name)
        return found

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Validate as the table does."""
        schema = core_schema.with_info_after_validator_function(
            self._validated, core_schema.any_schema()
        )
        return core_schema.nullable_schema(schema) if self.optional else schema

    def _validated(self, value: Any, info: core_schema.ValidationInfo) -> BaseModel:
        return self.table.model_validate(value, context=info.context)


def declaration(field: FieldInfo) -> DeclaredIn | None:
    """Return where the field's table is declared; None for a field with a type of its own."""
    return next((mark for mark in field.metadata if isinstance(mark, DeclaredIn)), None)


def type_of(field: FieldInfo) -> Any:
    """Return the type of what a key holds in TOML, wherever its table or its items' is declared."""
    declared = declaration(field)
    if declared is None:
        many = get_origin(field.annotation)
        if many not in (list, dict):
            return field.annotation
        *keys, item = get_args(field.annotation)
        marks = [mark for mark in get_args(item)[1:] if isinstance(mark, DeclaredIn)]
        return GenericAlias(many, (*keys, marks[0].table)) if marks else field.annotation
    table = declared.table
    return table.model_fields["root"].annotation if issubclass(table, RootModel) else table


def tables_in(kind: Any) -> Iterator[type[BaseModel]]:
    """Yield the tables that a type holds, such as those of a list of them."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        yield kind
    else:
        for part in get_args(kind):
            yield from tables_in(part)
