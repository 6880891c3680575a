"""The scene of one logged instant: bodies, planet, axes, arrows, trail and site."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.environment.orbit import Orbit, orbit_position
from mjspace.rendering import markers
from mjspace.rendering.arrows import AXES, ENGINE, Kind, body_axes, longest
from mjspace.rendering.plume import Plume
from mjspace.vehicle.indices import bus_id

_GEOM = mujoco.mjtObj.mjOBJ_GEOM
_HALO, _TRANSLUCENT = 2.2, 0.4  # the desired axes' thickness over the body's, and their opacity
_FASTEST = np.radians(30.0)  # per frame: beyond 45 deg a rotor of four spokes seems to reverse
_PLUME = 0.45  # the opacity of a thruster's plume
_SPARE_GEOMS = 64  # in addition to the model's: the desired axes, with reserve
_GROUND, _HIGH = "site_ground", 1e4  # m: above any hill


class Decoration(NamedTuple):
    """What is drawn around the vehicle at an instant."""

    arrows: Sequence[tuple[Kind, Array]]
    """Each with its vector (3,) [m], in its kind's axes."""
    trail: Array
    """Where the vehicle was [m], inertial axes, (n, 3)."""
    site: Array | None
    """Where it is to land, x and y (2,) [m]."""


class Stage:
    """A model's drawable scene, set to one instant after another.

    The planet is rotated with the orbit, so that it is at nadir. A rotor that turns further than 30
    degrees between two frames is drawn at 30 degrees per frame in its own sense. What is
    ``written`` at arrows and axes is not part of the scene.
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
        self.scene = mujoco.MjvScene(model, model.ngeom + _SPARE_GEOMS + markers.MOST_GEOMS)
        self._letters: list[markers.Letter] = []
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
        self._longest, self._named = longest(model), body_axes(model)
        self._ground = mujoco.mj_name2id(model, _GEOM, _GROUND)
        engine = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, ENGINE)
        self._engine = int(model.actuator_trnid[engine, 0]) if engine >= 0 else -1

    def set(
        self,
        time: float,
        physics: Array,
        desired: Array,
        pulses: Array | None = None,
        thrust: float = 0.0,
        decorated: Decoration | None = None,
    ) -> Array:
        """Set the scene to ``time`` [s] and return the attitude (4,) of the bus.

        ``physics`` is a row of MuJoCo's integration state, ``desired`` the desired attitude (4,).
        Thrusters with ``pulses`` (n,) above zero have a plume. ``thrust`` is the engine's share
        of its largest thrust, 0 to 1. Without ``decorated`` there are no letters either.
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
        self._letters = []
        if decorated is not None:
            self._decorate(decorated, bus)
        return bus

    def written(self) -> Iterator[tuple[float, float, str, Sequence[float]]]:
        """Yield each letter in the frame: where, from the middle and from above, and its color."""
        for letter in self._letters:
            place = markers.in_frame(self.scene, letter.place)
            if place is not None:
                yield *place, letter.text, letter.color

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

    def _decorate(self, decorated: Decoration, bus: Array) -> None:
        model, data, scene = self.model, self._data, self.scene
        origin = data.xpos[bus_id(model)].copy()
        for geom, name in self._named.items():
            along = attitude.rotate(bus, model.geom_pos[geom])
            length = float(np.linalg.norm(along)) + float(model.geom_size[geom, 1])
            color = model.geom_rgba[geom]
            self._letters.append(markers.axis_letter(origin, along, length, name, color))
        for kind, vector in decorated.arrows:
            if kind.frame == "body":
                vector = attitude.rotate(bus, vector)
            elif kind.frame == "engine":
                vector = data.site_xmat[self._engine].reshape(3, 3) @ vector
            self._letters += markers.add_arrow(
                scene, origin, vector, self._longest, kind.color, kind.letter
            )
        if len(decorated.trail):
            markers.add_trail(scene, np.concatenate([decorated.trail, origin[None]]))
        site = None if decorated.site is None else self._on_ground(decorated.site)
        if site is not None:
            self._letters += markers.add_site(scene, site)

    def _on_ground(self, place: Array) -> Array | None:
        """Return the point (3,) of the ground at x and y (2,); None where there is none."""
        if self._ground < 0:
            return None
        above, down = np.array([*place, _HIGH]), np.array([0.0, 0.0, -1.0])
        ground = self._ground
        if self.model.geom_type[ground] == mujoco.mjtGeom.mjGEOM_HFIELD:
            depth = mujoco.mj_rayHfield(self.model, self._data, ground, above, down)
        else:
            normal = self._data.geom_xmat[ground].reshape(3, 3)[:, 2]
            depth = (above - self._data.geom_xpos[ground]) @ normal / normal[2]
        point: Array = above + depth * down
        return point if depth >= 0.0 else None
