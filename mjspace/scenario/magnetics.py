"""The table of magnetorquers: coils in the Earth's magnetic field."""

from typing import Annotated

from pydantic import Field

from mjspace.scenario.fields import Positive, Si, Table, Time, Unit3


class Magnetorquers(Table):
    """Coils whose magnetic moment the Earth's field turns: one for each axis, all alike."""

    axes: Annotated[list[Unit3], Field(min_length=1)] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    """Axes of the coils in body axes, one row for each; normalized."""
    dipole_limit: Annotated[Positive, Si("A m^2")] | None = None
    """Largest magnetic moment of each; none when left out."""
    time_constant: Time = 0.0
    """With which the moment follows its command."""
