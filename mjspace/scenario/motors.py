"""The table of an electric drive in a scenario."""

from typing import Annotated, Literal

from pydantic import Field

from mjspace.scenario.fields import Positive, Si, Table


class Pmsm(Table):
    """A permanent-magnet synchronous motor, as two windings at right angles."""

    pole_pairs: Annotated[int, Field(ge=1, strict=True)]
    """Electrical turns in one of the rotor."""
    resistance: Annotated[Positive, Si("ohm")]
    """Of each winding."""
    inductance: Annotated[Positive, Si("H")]
    """Of each winding."""
    torque_constant: Annotated[Positive, Si("N m/A")]
    """Torque for each ampere across the rotor's field; the same number is the back-EMF in V s."""
    axes: Literal["rotor", "stator"] = "rotor"
    """In which its voltages are commanded, held from step to step, and its currents measured: those
    of the rotor take a sensor of its angle; the stator's are of the two windings themselves."""
    voltage_limit: Annotated[Positive, Si("V")] | None = None
    """Longest voltage vector that the supply gives; none when left out."""
