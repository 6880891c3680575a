"""The table of the ground in a scenario."""

import math
from typing import Annotated

from pydantic import Field

from mjspace.scenario.fields import NonNegative, Si, Table, WithinTurn


class Ground(Table):
    """What the vehicle lands on."""

    part: str = "moon_plain"
    """Name of a folder in assets/parts/ with a geom called ``ground``."""
    slope: Annotated[NonNegative, Field(lt=0.5 * math.pi), Si("rad")] = 0.0
    """How steep it is at the site."""
    downhill: WithinTurn = 0.0
    """Where the slope leads down to: from x towards y."""
