"""The table of what acts on a vehicle from outside: one line for each native term."""

from collections.abc import Iterator
from datetime import datetime
from typing import Annotated, Any, Literal, Self

from pydantic import ValidationInfo, field_validator, model_validator

from mjspace.scenario.declared import DeclaredIn
from mjspace.scenario.fields import Epoch, KindName, Table


class Environment(Table):
    """What acts on the vehicle from outside; nothing when left out."""

    epoch: Epoch | None = None
    """Time zero, UTC, of the magnetic field too. In an orbit around the Earth the Sun, the Moon,
    the Earth's shadow and the place above it are known with it: ``truth.sun_direction``,
    ``truth.moon_direction``, ``truth.sunlight``, ``truth.latitude``, ...."""
    shadow: Literal["cones", "cylinder"] = "cones"
    """Of the Earth: with a penumbra, or with an edge as of parallel light."""
    facets: list[
        Annotated[Any, DeclaredIn("mjspace.environment.facets:Facet", optional=False)]
    ] = []
    """Of the bus, for ``facet_drag`` and ``solar_pressure``."""

    # Each other key but python is the registration of a native term, mjspace.environment.base.Term,
    # or of a list of them. They are evaluated in this order.

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
    solar_pressure: Annotated[
        Any, DeclaredIn("mjspace.environment.solar_pressure:SolarPressure")
    ] = None
    residual_dipole: Annotated[
        Any, DeclaredIn("mjspace.environment.residual_dipole:ResidualDipole")
    ] = None
    hysteresis_rods: list[
        Annotated[
            Any, DeclaredIn("mjspace.environment.hysteresis_rod:HysteresisRod", optional=False)
        ]
    ] = []
    """On the bus, in the magnetic field."""
    python: KindName | None = None
    """A function of one's own, ``"file.py:name"``: name(time, truth) -> (force [N] on the bus in
    inertial axes, torque [N m] in body axes), held over each integration step: first order only."""

    @property
    def terms(self) -> Iterator[Any]:
        """The native terms that there are, in order."""
        for _, value in self:
            several = value if isinstance(value, list) else [value]
            yield from (term for term in several if hasattr(term, "kernels"))

    @property
    def time_zero(self) -> datetime | None:
        """Time zero, UTC: the epoch, or that of the orbit's two-line elements; None without."""
        return self.epoch or (None if self.orbit is None else self.orbit.time_zero)

    @property
    def stale_orbit(self) -> str:
        """A warning of an orbit that is not known any more at time zero; empty for any other."""
        return "" if self.orbit is None else str(self.orbit.stale)

    @property
    def has_sun(self) -> bool:
        """Whether it is known where the Sun is."""
        return self.time_zero is not None and self.orbit is not None and self.orbit.body == "earth"

    @field_validator("epoch")
    @classmethod
    def _sun_is_known(cls, epoch: datetime | None) -> datetime | None:
        if epoch is not None and not 1900 <= epoch.year < 2100:
            raise ValueError(f"{epoch:%Y-%m-%d}: the Sun's place is known from 1900 to 2100")
        return epoch

    @field_validator("orbit")
    @classmethod
    def _begun(cls, orbit: Any, info: ValidationInfo) -> Any:
        return None if orbit is None else orbit.begun_at(info.data.get("epoch"))

    @model_validator(mode="after")
    def _terms_can_act(self) -> Self:
        for term in self.terms:
            term.check_environment(self)
        return self
