"""The table of a vehicle's reaction-control thrusters in a scenario."""

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from mjspace.scenario.fields import Meters3, Positive, Seconds, Si, Table, Time, Unit3


class Rcs(Table):
    """On/off thrusters that are all alike, one for each row of ``positions``.

    Their command is an ``on_time`` for each, of the control period that begins. Propellant is in a
    spherical tank at the body origin, full of hydrazine at first; it loses mass and keeps its size.
    """

    positions: Annotated[list[Meters3], Field(min_length=1)]
    """Where each pushes, body axes."""
    directions: list[Unit3]
    """Of each one's force on the vehicle, body axes; normalized."""
    thrust: Annotated[Positive, Si("N")]
    """Of each, steady."""
    minimum_on: Time = 0.0
    """A valve that opens stays open at least that long, even if asked for less."""
    delay: Time = 0.0
    """From the command to the valve, for opening and closing alike."""
    rise: Time = 0.0
    """Time constant with which the thrust follows its valve."""
    specific_impulse: Seconds | None = None
    """Thrust over the weight of the propellant's flow, on Earth; burns nothing when left out."""
    propellant: Annotated[Positive, Si("kg")] | None = None
    """In the tank at the start; goes with ``specific_impulse``."""

    @model_validator(mode="after")
    def _consistent(self) -> "Rcs":
        if len(self.directions) != len(self.positions):
            raise ValueError(
                f"directions: {len(self.directions)} rows for {len(self.positions)} positions: "
                "give as many"
            )
        if (self.specific_impulse is None) != (self.propellant is None):
            raise ValueError("specific_impulse and propellant: give both or neither")
        return self

    @property
    def unit_directions(self) -> list[list[float]]:
        """``directions``, each of length one."""
        rows = np.array(self.directions)
        unit: list[list[float]] = (rows / np.linalg.norm(rows, axis=1, keepdims=True)).tolist()
        return unit
