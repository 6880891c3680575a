"""The scene of one logged instant: bodies, planet, body axes and desired axes."""

from typing import Any

import mujoco
import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.orbit import Orbit, orbit_position
from mjspace.rendering.plume import Plume
from mjspace.vehicle.indices import bus_id

_GEOM = mujoco.mjtObj.mjOBJ_GEOM
AXES = 3
"""The geom group of a model's body axes: no part of the vehicle, but drawn."""
_HALO, _TRANSLUCENT = 2.2, 0.4  # the desired axes' thickness over the body's, and their opacity
_FASTEST = np.radians(30.0)  # per frame: beyond 45 deg a rotor of four spokes seems to reverse
_PLUME = 0.45  # the opacity of a thruster's plume
_SPARE_GEOMS = 64  # in addition to the model's: the desired axes, with reserve


class Stage:
    """A model's drawable scene, set to one instant after another.

    The planet is rotated with the orbit, so that it is at nadir. A rotor that turns further than 30
    degrees between two frames is drawn at 30 degrees per frame in its own sense.
    """

    def __init__(self, model: Any, camera: str, orbit: Orbit | None) -> None:
        """Prepare to draw ``model`` through one of its cameras.

        Raises:
            ValueError: the camera does not exist; the message lists those that do.
        """
        names = [model.camera(index).name for index in range(model.ncam)]
        if camera not in names:
            raise ValueError(f"no camera {camera!r}: have {', '.join(names)}")
        self.model = model
        self.scene = mujoco.MjvScene(model, model.ngeom + _SPARE_GEOMS)
        self._data = mujoco.MjData(model)
        self._perturb, self._option = mujoco.MjvPerturb(), mujoco.MjvOption()
        self._option.geomgroup[AXES] = 1
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = names.index(camera)
        self._axes = np.flatnonzero(model.geom_group == AXES).tolist()
        self._rotors = model.jnt_qposadr[model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE]
        # On/off thrusters have a plume each, by the motor's name.
        motors = [model.actuator(index).name for index in range(model.nu)]
        plumes = [mujoco.mj_name2id(model, _GEOM, f"{motor}_plume") for motor in motors]
        self._plumes = [geom for geom in plumes if geom >= 0]
        self._angle: Array | None = None
        self._orbit = orbit
        self._planet = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "planet")
        self._below = model.geom_pos[self._planet].copy(), model.geom_quat[self._planet].copy()
        self._plume = Plume(model)

    def set(
        self,
        time: float,
        physics: Array,
        desired: Array,
        pulses: Array | None = None,
        thrust: float = 0.0,
    ) -> Array:
        """Set the scene to ``time`` [s] and return the attitude (4,) of the bus.

        ``physics`` is a row of MuJoCo's integration state, ``desired`` the desired attitude (4,).
        Thrusters with ``pulses`` (n,) above zero have a plume. ``thrust`` is the engine's share
        of its largest thrust, 0 to 1.
        """
        model, data = self.model, self._data
        mujoco.mj_setState(model, data, physics, mujoco.mjtState.mjSTATE_INTEGRATION)
        self._turn_rotors()
        if self._orbit is not None and self._planet >= 0:
            self._turn_planet(orbit_position(self._orbit, time))
        if pulses is not None:
            model.geom_rgba[self._plumes, 3] = _PLUME * (pulses > 0.0)
        self._plume.burn(thrust, self._option)
        mujoco.mj_fwdPosition(model, data)
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(
            model, data, self._option, self._perturb, self._camera, everything, self.scene
        )
        self._plume.lift_shadow(self.scene)
        for geom in self._axes:
            self._add_desired(geom, desired)
        bus: Array = data.xquat[bus_id(model)].copy()
        return bus

    def _turn_rotors(self) -> None:
        angle = self._data.qpos[self._rotors]
        if self._angle is None:
            self._angle = self._drawn = angle
        self._drawn = self._drawn + np.clip(angle - self._angle, -_FASTEST, _FASTEST)
        self._angle = angle
        self._data.qpos[self._rotors] = self._drawn

    def _turn_planet(self, up: Array) -> None:
        """Move the planet from -z, where the model has it, to the direction opposite to ``up``."""
        turn = np.empty(4)
        mujoco.mju_quatZ2Vec(turn, up)
        place, orientation = self._below
        self.model.geom_pos[self._planet] = attitude.rotate(turn, place)
        self.model.geom_quat[self._planet] = attitude.multiply(turn, orientation)

    def _add_desired(self, axis: int, desired: Array) -> None:
        """Add a halo for a body axis (a geom) at its desired orientation."""
        model, scene = self.model, self.scene
        origin = self._data.xpos[model.geom_bodyid[axis]]
        mujoco.mjv_initGeom(
            scene.geoms[scene.ngeom],
            model.geom_type[axis],
            model.geom_size[axis] * [_HALO, 1.0, 1.0],
            origin + attitude.rotate(desired, model.geom_pos[axis]),
            attitude.to_matrix(attitude.multiply(desired, model.geom_quat[axis])).ravel(),
            model.geom_rgba[axis] * [1.0, 1.0, 1.0, _TRANSLUCENT],
        )
        scene.ngeom += 1
