"""What is drawn around a vehicle: arrows, letters, the trail of its path, the landing site."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.log.arrows import TRAIL, to_one

MOST_GEOMS = 400
"""That the functions here add to a scene, together."""
TRAIL_POINTS = 250
"""Of a trail, at most."""
_ARROW, _LINE = mujoco.mjtGeom.mjGEOM_ARROW, mujoco.mjtGeom.mjGEOM_LINE
_CYLINDER = mujoco.mjtGeom.mjGEOM_CYLINDER
_GLOW = 0.6  # so that an arrow has its color in the shade as well
_BEYOND = 0.06  # from an arrow's point to its letter, over the longest arrow
_THICK = 0.012  # half an arrow's thickness, over the longest arrow
_SHORTEST = 0.02  # of an arrow that is drawn, over the longest
_WHITE, _RED = (0.95, 0.95, 0.95), (0.85, 0.15, 0.1)
_UP = np.array([0.0, 0.0, 1.0])
_FAR = 80.0  # m: from where ring and rod are too small
_RING, _ROD, _AWAY = 2.0, 5, 3.0  # m: the ring's radius, the rod's height and distance from it


class Letter(NamedTuple):
    """A letter at a place in the scene."""

    text: str
    place: Array
    """Inertial axes [m], (3,)."""
    color: Sequence[float]


def add_arrow(
    scene: Any, start: Array, vector: Array, longest: float, color: Sequence[float], letter: str
) -> list[Letter]:
    """Add an arrow from ``start`` (3,) along ``vector`` (3,) [m], and return the letter at its end.

    Its thickness goes with the ``longest`` [m]; one of 2 % of that is left out.
    """
    length = float(np.linalg.norm(vector))
    if length < _SHORTEST * longest:
        return []
    # MuJoCo draws an arrow half as long as mjv_connector makes it.
    _connect(scene, _ARROW, _THICK * longest, start, start + 2.0 * vector, color)
    return [Letter(letter, start + vector * (1.0 + _BEYOND * longest / length), color)]


def axis_letter(origin: Array, axis: Array, length: float, name: str, color: Any) -> Letter:
    """Return the letter beyond the end of a body axis, which points along ``axis`` (3,)."""
    along = axis / np.linalg.norm(axis)
    return Letter(name, origin + (1.0 + _BEYOND) * length * along, color[:3].tolist())


def add_trail(scene: Any, points: Array) -> None:
    """Add a line through points (n, 3) [m]."""
    for start, end in pairwise(points):
        _connect(scene, _LINE, 2.0, start, end, to_one(TRAIL))


def add_site(scene: Any, place: Array) -> list[Letter]:
    """Add a ring of 2 m around a place (3,), and 3 m from it a rod of 5 m in bands of 1 m.

    Returned is what is written there: how long the rod is, or from afar that this is the site.
    """
    angle = np.linspace(0.0, 2.0 * np.pi, 37)
    across = np.stack([np.cos(angle), np.sin(angle), np.zeros(37)], axis=1)
    for start, end in pairwise(place + 0.05 * _UP + _RING * across):
        _connect(scene, _CYLINDER, 0.04, start, end, _RED)
    foot = place + np.array([0.0, _AWAY, 0.0])
    for band in range(_ROD):
        color = _WHITE if band % 2 else _RED
        _connect(scene, _CYLINDER, 0.05, foot + band * _UP, foot + (band + 1) * _UP, color)
    if np.linalg.norm(scene.camera[0].pos - place) > _FAR:
        return [Letter("site", place, _WHITE)]
    return [Letter(f"{_ROD} m", foot + (_ROD + 0.3) * _UP, _WHITE)]


def _connect(
    scene: Any, kind: Any, width: float, start: Array, end: Array, color: Sequence[float]
) -> None:
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(geom, kind, np.zeros(3), start, np.eye(3).ravel(), np.array([*color, 1.0]))
    mujoco.mjv_connector(geom, kind, width, start, end)
    geom.category, geom.emission = mujoco.mjtCatBit.mjCAT_DECOR, _GLOW
    scene.ngeom += 1


def in_frame(scene: Any, place: Array) -> tuple[float, float] | None:
    """Return where the scene's camera shows a place (3,), in heights of the frame.

    From the middle to the right, and from above; None of a place behind the camera.
    """
    eyes = scene.camera
    camera = eyes[0]
    away = place - 0.5 * (eyes[0].pos + eyes[1].pos)
    depth = float(away @ camera.forward)
    if depth < camera.frustum_near:
        return None
    at_near = camera.frustum_near / depth
    right = np.cross(camera.forward, camera.up)
    across, up = at_near * float(away @ right), at_near * float(away @ camera.up)
    height = camera.frustum_top - camera.frustum_bottom
    return across / height, (camera.frustum_top - up) / height
