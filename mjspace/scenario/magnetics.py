"""The tables of what is magnetic in a scenario: the Earth's field, and the magnetorquers in it."""

import math
from datetime import UTC, datetime
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from mjspace.scenario.fields import NonNegative, Positive, Si, Table, Time, Unit3


class MagneticField(Table):
    """The Earth's magnetic field along the orbit; inertial x is at the equinox, z at the pole."""

    model: Literal["dipole", "igrf"] = "dipole"
    """A tilted dipole at the centre, or the International Geomagnetic Reference Field (IGRF-14)."""
    epoch: datetime = datetime(2025, 1, 1)
    """Time zero, UTC: which way the Earth has turned by then, and of which day the field is, of the
    dipole too: IGRF-14 is valid from 1900 to 2030, and other dates are refused."""
    tilt: Annotated[NonNegative, Field(le=math.pi), Si("rad")] | None = None
    """Of the dipole to the Earth's axis; the Earth's own when left out."""

    @field_validator("epoch", mode="before")
    @classmethod
    def _written_out(cls, epoch: Any) -> Any:
        if isinstance(epoch, int | float) or (isinstance(epoch, str) and "-" not in epoch):
            raise ValueError(f"got {epoch!r}, should be a date as in 2025-01-01T12:00:00")
        return epoch

    @field_validator("epoch")
    @classmethod
    def _known(cls, epoch: datetime) -> datetime:
        universal = epoch.astimezone(UTC).replace(tzinfo=None) if epoch.tzinfo else epoch
        if not 1900 <= universal.year < 2030:
            raise ValueError(f"{epoch:%Y-%m-%d}: the field (IGRF-14) is known from 1900 to 2030")
        return universal


class Magnetorquers(Table):
    """Coils whose magnetic moment the Earth's field turns: one for each axis, all alike."""

    axes: Annotated[list[Unit3], Field(min_length=1)] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    """Axes of the coils in body axes, one row for each; normalized."""
    dipole_limit: Annotated[Positive, Si("A m^2")] | None = None
    """Largest magnetic moment of each; none when left out."""
    time_constant: Time = 0.0
    """With which the moment follows its command."""
