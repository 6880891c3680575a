"""Ports: the places at which spacecraft are connected."""

from typing import Annotated

from mjspace.scenario.fields import Positive, Si
from mjspace.scenario.mounted import Mounted


class Port(Mounted):
    """A place on a spacecraft, with axes: those of two ports coincide when they are docked.

    Its x is the docking axis: out of the vehicle, and into the other spacecraft.
    """

    body: str | None = None
    """Which carries it, and has the axes of ``position`` and ``euler``: the bus when left out."""
    radius: Annotated[Positive, Si("m")] = 0.05
    """Of the ring that is drawn there."""
