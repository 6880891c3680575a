"""The tables of a landing in a scenario: gravity at the site, and the ground."""

import math
from typing import Annotated, Literal

from pydantic import Field

from mjspace.scenario.fields import NonNegative, Positive, Si, Table, WithinTurn


class CentralGravity(Table):
    """A planet's gravity on every body, in the frame of a landing site.

    The frame's origin is on the sphere of the planet's radius, z up; it does not turn.
    """

    body: Literal["earth", "moon"] = "moon"
    """What is landed on."""
    gm: Annotated[Positive, Si("m^3/s^2")] | None = None
    """Gravitational parameter; the body's when left out."""
    radius: Annotated[Positive, Si("m")] | None = None
    """From the planet's centre to the origin; the body's when left out."""


class Ground(Table):
    """What the vehicle lands on."""

    part: str = "moon_plain"
    """Name of a folder in assets/parts/ with a geom called ``ground``."""
    slope: Annotated[NonNegative, Field(lt=0.5 * math.pi), Si("rad")] = 0.0
    """How steep it is at the site."""
    downhill: WithinTurn = 0.0
    """Where the slope leads down to: from x towards y."""
