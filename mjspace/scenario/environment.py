"""The table of what acts on a vehicle from outside: one line for each native term."""

from collections.abc import Iterator
from typing import Annotated, Any, Self

from pydantic import model_validator

from mjspace.scenario.declared import DeclaredIn
from mjspace.scenario.fields import KindName, Table


class Environment(Table):
    """What acts on the vehicle from outside; nothing when left out."""

    # Each key but python is the registration of a native term, mjspace.environment.base.Term, or
    # of a list of them. They are evaluated in this order.

    magnetic_field: Annotated[
        Any, DeclaredIn("mjspace.environment.magnetic_field:MagneticField")
    ] = None
    orbit: Annotated[Any, DeclaredIn("mjspace.environment.orbit:Orbit")] = None
    gravity: Annotated[Any, DeclaredIn("mjspace.environment.gravity:CentralGravity")] = None
    torques: list[
        Annotated[
            Any,
            DeclaredIn("mjspace.environment.disturbance_torque:DisturbanceTorque", optional=False),
        ]
    ] = []
    """Evaluated at every stage of the integrator."""
    facet_drag: Annotated[Any, DeclaredIn("mjspace.environment.facet_drag:FacetDrag")] = None
    python: KindName | None = None
    """A function of one's own, ``"file.py:name"``: name(time, truth) -> (force [N] on the bus in
    inertial axes, torque [N m] in body axes), held over each integration step: first order only."""

    @property
    def terms(self) -> Iterator[Any]:
        """The native terms that there are, in order."""
        for _, value in self:
            several = value if isinstance(value, list) else [value]
            yield from (term for term in several if isinstance(term, Table))

    @model_validator(mode="after")
    def _terms_can_act(self) -> Self:
        for term in self.terms:
            term.check_environment(self)
        return self
