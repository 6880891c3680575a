"""What is fitted to a vehicle: tables that are declared in the file of what they describe."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from importlib import import_module
from types import GenericAlias
from typing import Any, ClassVar, Self, get_args, get_origin

from pydantic import BaseModel, GetCoreSchemaHandler, RootModel
from pydantic.fields import FieldInfo
from pydantic_core import core_schema

from mjspace.scenario.hinges import Friction


@dataclass(frozen=True)
class DeclaredIn:
    """Marks a key whose table is declared in another file, which is imported when it is needed.

    A scenario can so name the tables of rooms that build on it. The model that has the key, and
    every model around it, needs ``defer_build=True`` in its ``model_config``: its schema is then
    built when a scenario is first validated.
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
        schema = handler.generate_schema(self.table)
        return core_schema.nullable_schema(schema) if self.optional else schema


def declaration(field: FieldInfo) -> DeclaredIn | None:
    """Return where the field's table is declared; None for a field with a type of its own."""
    return next((mark for mark in field.metadata if isinstance(mark, DeclaredIn)), None)


def type_of(field: FieldInfo) -> Any:
    """Return the type of what a key holds in TOML, wherever its table or its items' is declared."""
    declared = declaration(field)
    if declared is None:
        if get_origin(field.annotation) is not list:
            return field.annotation
        (item,) = get_args(field.annotation)
        marks = [mark for mark in get_args(item)[1:] if isinstance(mark, DeclaredIn)]
        return GenericAlias(list, marks[0].table) if marks else field.annotation
    table = declared.table
    return table.model_fields["root"].annotation if issubclass(table, RootModel) else table


@dataclass(frozen=True)
class Driven:
    """What an actuator drives in the compiled model, by name."""

    motors: tuple[str, ...] = ()
    """MuJoCo's actuators that it commands, side by side in ``ctrl`` and in that order."""
    gimbals: tuple[str, ...] = ()
    """Hinges whose angles and rates are those of gimbals, the outer before the inner."""
    wheels: tuple[str, ...] = ()
    """Hinges whose speeds are measured as those of wheels."""
    encoded_wheels: tuple[str, ...] = ()
    """Those of the ``wheels`` whose angles are measured as well."""

    @classmethod
    def together(cls, parts: Iterable[Self]) -> Self:
        """Return what several actuators drive, one after the other."""
        listed = list(parts)
        return cls(*(sum((getattr(p, f.name) for p in listed), ()) for f in fields(cls)))


class Equipment:
    """Base of the table of something fitted to a vehicle; every method has a default."""

    excludes: ClassVar[tuple[str, ...]] = ()
    """Keys of the plant that cannot be given beside this one."""
    cure: ClassVar[str] = "give one"
    """What to do where another key excludes this one."""
    before_parts: ClassVar[bool] = False
    """Whether it is attached before the plant's parts, so that its joints and motors come first."""

    @property
    def fitted(self) -> bool:
        """Whether the table describes anything at all."""
        return True

    def attach(self, spec: Any) -> None:
        """Add its bodies, joints, sites and motors to the vehicle's ``MjSpec``.

        Raises:
            ValueError: it cannot be attached.
        """

    def driven(self, model: Any) -> Driven:
        """Return what of the compiled ``MjModel`` it drives.

        Raises:
            ValueError: the model lacks it.
        """
        return Driven()

    def dry_friction(self) -> dict[str, Friction]:
        """Return the dry friction of its hinges, by name."""
        return {}
