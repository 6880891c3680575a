"""The tables of what is magnetic in a scenario: the Earth's field, and the magnetorquers in it."""

from datetime import UTC, datetime
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator

from mjspace.fields import Angle, Positive, Si, Table, Time, Unit3


class MagneticField(Table):
    """The Earth's magnetic field along the orbit; inertial x is at the equinox, z at the pole."""

    model: Literal["dipole", "igrf"] = "dipole"
    """A tilted dipole at the centre, or the International Geomagnetic Reference Field (IGRF-14)."""
    epoch: datetime = datetime(2025, 1, 1)
    """Time zero, UTC: which way the Earth has turned by then, and of which day the field is, of the
    dipole too: IGRF-14 is valid from 1900 to 2030, and other dates are refused."""
    tilt: Angle | None = None
    """Of the dipole to the Earth's axis; the Earth's own when left out."""

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

    @field_validator("axes")
    @classmethod
    def _directed(cls, axes: list[list[float]]) -> list[list[float]]:
        if any(np.linalg.norm(axis) < 1e-9 for axis in axes):
            raise ValueError("an axis has no direction")
        return axes
