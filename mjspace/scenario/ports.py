"""Ports: the places at which spacecraft are connected."""

from typing import Annotated

from mjspace.scenario.fields import Angles3, Meters3, Positive, Si, Table


class Port(Table):
    """A place on a spacecraft, with axes: those of two ports coincide when they are docked.

    Its x is the docking axis: out of the vehicle, and into the other spacecraft.
    """

    body: str | None = None
    """Which carries it: the bus when left out."""
    position: Meters3 = [0.0, 0.0, 0.0]
    """In the axes of that body."""
    euler: Angles3 = [0.0, 0.0, 0.0]
    """Roll, pitch, yaw of its axes in the body's."""
    radius: Annotated[Positive, Si("m")] = 0.05
    """Of the ring that is drawn there."""
