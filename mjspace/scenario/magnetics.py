"""The table of the Earth's magnetic field in a scenario."""

import math
from datetime import UTC, datetime
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from mjspace.scenario.fields import NonNegative, Si, Table


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
