"""The plume of a gimballed engine: length and brightness follow the thrust."""

from typing import Any

import mujoco
import numpy as np

PLUME = 4
"""The geom group of a plume's ellipsoids, whose third axis is along the plume.

The model has their size at full thrust. Lights on the same body belong to the plume.
"""


class Plume:
    """The geoms and lights of a model's plume; of a model without plume none."""

    def __init__(self, model: Any) -> None:
        self._model = model
        self._geoms = np.flatnonzero(model.geom_group == PLUME)
        self._length = model.geom_size[self._geoms, 2]
        self._root = model.geom_pos[self._geoms, 2] + self._length
        self._materials = np.unique(model.geom_matid[self._geoms])
        self._opacity = model.mat_rgba[self._materials, 3]
        self._lights = np.isin(model.light_bodyid, model.geom_bodyid[self._geoms])
        self._brightness = model.light_diffuse[self._lights]

    def burn(self, share: float, option: Any) -> None:
        """Set the model and a ``mujoco.MjvOption`` to this share of full thrust, 0 to 1.

        The root of the plume stays in the throat of the nozzle.
        """
        model, geoms = self._model, self._geoms
        option.geomgroup[PLUME] = share > 0.0
        model.light_active[self._lights] = share > 0.0
        model.light_diffuse[self._lights] = share * self._brightness
        model.geom_size[geoms, 2] = share * self._length
        model.geom_pos[geoms, 2] = self._root - share * self._length
        model.mat_rgba[self._materials, 3] = np.sqrt(share) * self._opacity

    def lift_shadow(self, scene: Any) -> None:
        """Make the plume in a ``mujoco.MjvScene`` a decoration, which casts no shadow."""
        geoms = set(self._geoms.tolist())
        for geom in scene.geoms[: scene.ngeom] if geoms else ():
            if geom.objtype == mujoco.mjtObj.mjOBJ_GEOM and geom.objid in geoms:
                geom.category = mujoco.mjtCatBit.mjCAT_DECOR
