"""The tables of what goes wrong with a vehicle's actuators."""

from typing import Any, Literal

from pydantic import field_validator, model_validator

from mjspace.scenario.fields import Finite, Seconds, Table, Time
from mjspace.scenario.region import Region
from mjspace.units import any_to_si

WANTS_VALUE = ("biased", "scaled", "delayed", "noisy")


class Fault(Table):
    """From a moment on a motor gives something else than its model says; the log mentions when."""

    motor: str
    """Its name, ``wheel_0`` or ``thruster_3``; or all of a kind, or one of them, as /command has
    them: ``thruster_thrust``, ``thruster_thrust[3]``, ``magnetic_moment[2]``."""
    kind: Literal["dead", "stuck", "biased", "scaled", "delayed", "noisy"]
    """It gives nothing; what it gave when the fault began; ``value`` more; ``value`` times as much;
    what it should have given ``value`` seconds before; noise of standard deviation ``value``
    more."""
    value: Finite | None = None
    """Of all kinds but dead and stuck; a number in SI or a quantity."""
    at: Time | None = None
    """When it begins: at the first integration step that is not before."""
    when: Region | None = None
    """Or the first control period in which a signal is inside: one of ``truth`` as ideal sensors
    see it, ``measurement``, ``command`` or ``law``."""
    until: Seconds | None = None
    """When it is over; never when left out."""

    @field_validator("value", mode="before")
    @classmethod
    def _quantity(cls, value: Any) -> Any:
        return any_to_si(value) if isinstance(value, str) else value

    @model_validator(mode="after")
    def _consistent(self) -> "Fault":
        if (self.value is not None) != (self.kind in WANTS_VALUE):
            raise ValueError(f"value: a motor that is {self.kind} has " + self._what_it_has())
        if (self.at is None) == (self.when is None):
            raise ValueError("at and when: give one of them")
        if self.at is not None and self.until is not None and self.until <= self.at:
            raise ValueError(f"until {self.until:g} s is not after at {self.at:g} s")
        if self.kind in ("delayed", "noisy") and not (self.value or 0.0) > 0.0:
            raise ValueError(f"value {self.value:g} of one that is {self.kind}: more than 0")
        return self

    def _what_it_has(self) -> str:
        return "none" if self.value is not None else "one: give it"
