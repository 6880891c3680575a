"""What is fitted to a vehicle: the base of the tables of actuators."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Self

from mjspace.scenario.hinges import Friction


@dataclass(frozen=True)
class Driven:
    """What an actuator drives in the compiled model, by name."""

    motors: tuple[str, ...] = ()
    """MuJoCo's actuators that it commands, in the order of what it applies."""
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

    @property
    def rotors(self) -> Any:
        """Its wheels on the bus, ``vehicle.mass_properties.Rotors``; None where it has none."""
        return None

    def attach(self, spec: Any) -> None:
        """Add its bodies, joints, sites and motors to the vehicle's ``MjSpec``.

        Raises:
            ValueError: it cannot be attached.
        """

    def driven(self, model: Any) -> Driven:
        """Return what of the compiled ``MjModel`` it drives by itself.

        Raises:
            ValueError: the model lacks it.
        """
        return Driven()

    def driven_hinges(self, hinges: Sequence[str]) -> Driven:
        """Return what it drives of the ``hinges`` with a motor that no equipment drives by itself.

        They are named as their motors, in the order of ``ctrl``.

        Raises:
            ValueError: a hinge that it needs is not among them.
        """
        return Driven()

    def dry_friction(self) -> dict[str, Friction]:
        """Return the dry friction of its hinges, by name."""
        return {}
