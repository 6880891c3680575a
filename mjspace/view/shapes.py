"""The geometry of a ``foxglove.SceneUpdate`` as triangles, one mesh for each color of a body."""

from typing import Any, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from numpy.typing import NDArray

from mjspace.contract import Array

_SIDES = 48  # of a cylinder and a sphere
_RINGS = 24  # of a sphere, from pole to pole
_Triangles = tuple[Array, NDArray[np.int_]]  # vertices and faces


class Mesh(NamedTuple):
    """Triangles of one color in the axes of their body."""

    vertices: Array
    """[m], (n, 3)"""
    faces: NDArray[np.int_]
    """(m, 3)"""
    color: tuple[float, ...]
    """Red, green, blue and opacity, 0 to 1."""


class Body(NamedTuple):
    """What is drawn of a body."""

    name: str
    meshes: list[Mesh]

    @property
    def radius(self) -> float:
        """How far it reaches from its origin [m]; 0 where nothing is drawn."""
        far = [float(np.linalg.norm(mesh.vertices, axis=1).max()) for mesh in self.meshes]
        return max(far, default=0.0)


def scene_update(serialized: bytes) -> Any:
    """Return a ``foxglove.SceneUpdate`` that this program serialized."""
    return SceneUpdate.FromString(serialized)


def bodies(update: Any) -> list[Body]:
    """Return the bodies of a ``foxglove.SceneUpdate``.

    Raises:
        ValueError: a mesh in it has faces of vertices that it does not have.
    """
    return [Body(entity.frame_id, _meshes(entity)) for entity in update.entities]


def _meshes(entity: Any) -> list[Mesh]:
    found: dict[tuple[float, ...], list[_Triangles]] = {}
    for kind, (vertices, faces) in _UNITS.items():
        for shape in getattr(entity, kind):
            size = np.array([shape.size.x, shape.size.y, shape.size.z])
            placed = _placed(shape.pose, size * vertices)
            found.setdefault(_color(shape.color), []).append((placed, faces))
    for shape in entity.triangles:
        points = np.array([(p.x, p.y, p.z) for p in shape.points]).reshape(-1, 3)
        faces = np.array(shape.indices, dtype=int).reshape(-1, 3)
        if faces.size and faces.max() >= len(points):
            raise ValueError(f"/scene: a mesh has {len(points)} vertices and no {faces.max()}")
        if faces.size:
            placed = _placed(shape.pose, points)
            found.setdefault(_color(shape.color), []).append((placed, faces))
    return [Mesh(*_joined(parts), color) for color, parts in found.items()]


def _turned(radius: Array, height: Array) -> _Triangles:
    """Return the solid of revolution about z of an outline that begins and ends on the axis.

    ``radius`` and ``height`` (n,) go upwards. At each end all of a ring's vertices are one point.
    """
    angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    rings = [
        radius[:, None] * np.cos(angle),
        radius[:, None] * np.sin(angle),
        np.repeat(height[:, None], _SIDES, axis=1),
    ]
    low, side = np.mgrid[: len(radius) - 1, :_SIDES].reshape(2, -1)
    after = (side + 1) % _SIDES
    a, b = low * _SIDES + side, low * _SIDES + after
    c, d = b + _SIDES, a + _SIDES
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    return np.stack(rings, axis=-1).reshape(-1, 3), faces


def _cube() -> _Triangles:
    corners = np.array(list(np.ndindex(2, 2, 2))) - 0.5
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [each for a, b, c, d in sides for each in ((a, b, c), (a, c, d))]
    return corners, np.array(faces)


_LATITUDE = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _RINGS + 1)
_UNITS = {
    "cubes": _cube(),
    "cylinders": _turned(np.array([0.0, 0.5, 0.5, 0.0]), np.array([-0.5, -0.5, 0.5, 0.5])),
    "spheres": _turned(0.5 * np.cos(_LATITUDE), 0.5 * np.sin(_LATITUDE)),
}
"""Solids of size 1, outward by the order of each face's vertices."""


def _joined(parts: list[_Triangles]) -> _Triangles:
    firsts = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    faces = [of_part + first for first, (_, of_part) in zip(firsts, parts, strict=True)]
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate(faces)


def _placed(pose: Any, points: Array) -> Array:
    # Without mjspace.attitude, which compiles its functions when they are first called: that would
    # be half of the time to the first picture. v + 2 w (q x v) + 2 q x (q x v).
    turn, place = pose.orientation, pose.position
    axis = np.array([turn.x, turn.y, turn.z])
    twice = 2.0 * np.cross(axis, points)
    turned = points + turn.w * twice + np.cross(axis, twice)
    placed: Array = turned + np.array([place.x, place.y, place.z])
    return placed


def _color(color: Any) -> tuple[float, ...]:
    return color.r, color.g, color.b, color.a
