"""The ground below a vehicle: its table in a scenario, and how it is laid into the model."""

import math
from typing import Annotated, Any

import mujoco
import numpy as np
from pydantic import Field

from mjspace.scenario.fields import NonNegative, Si, Table, WithinTurn
from mjspace.vehicle import ground_contact
from mjspace.vehicle.composition import ASSETS

CENTIMETRES = 2
"""Decimals of the heights in metres that flight software is given as a map."""


class Ground(Table):
    """What the vehicle lands on."""

    part: str = "moon_plain"
    """Name of a folder in assets/parts/ with a geom called ``ground``."""
    slope: Annotated[NonNegative, Field(lt=0.5 * math.pi), Si("rad")] = 0.0
    """How steep it is at the site."""
    downhill: WithinTurn = 0.0
    """Where the slope leads down to: from x towards y."""

    def attach(self, spec: Any) -> None:
        """Lay the ground through the origin of the vehicle's ``MjSpec``, sloping ``downhill``.

        Raises:
            ValueError: no such part.
        """
        known = {path.parent.name: path for path in sorted(ASSETS.glob("parts/moon_*/*.xml"))}
        if self.part not in known:
            raise ValueError(f"plant.ground.part: no part {self.part!r}: have {', '.join(known)}")
        across = [-np.sin(self.downhill), np.cos(self.downhill), 0.0]
        frame = spec.worldbody.add_frame()
        mujoco.mju_axisAngle2Quat(frame.quat, np.array(across), self.slope)
        spec.attach(mujoco.MjSpec.from_file(str(known[self.part])), prefix="site_", frame=frame)
        ground_contact.add_sensors(spec, "site_ground")


def map_of(model: Any) -> dict[str, Any]:
    """Return the map of a model's ground as a law or a reference may take it.

    "ground_heights" (m, n) [m] to the centimetre, rows along y and columns along x about the site,
    and their "ground_spacing" [m]. There is none of a plane, nor of a slope, whose field is turned.
    """
    grounds = [model.geom(i) for i in range(model.ngeom) if model.geom(i).name == "site_ground"]
    if not grounds or model.geom_type[grounds[0].id] != mujoco.mjtGeom.mjGEOM_HFIELD:
        return {}
    ground = grounds[0]
    if np.any(ground.quat != [1.0, 0.0, 0.0, 0.0]):
        return {}
    field = model.hfield(int(ground.dataid[0]))
    heights = ground.pos[2] + field.size[2] * field.data.reshape(field.nrow[0], field.ncol[0])
    spacing = 2.0 * float(field.size[0]) / (int(field.ncol[0]) - 1)
    return {"ground_heights": np.round(heights, CENTIMETRES), "ground_spacing": spacing}
