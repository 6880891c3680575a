"""The geometry of a ``foxglove.SceneUpdate`` as triangles, one mesh for each color of a body."""

from typing import Any, NamedTuple

import numpy as np
import trimesh
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from numpy.typing import NDArray

from mjspace.attitude import rotate
from mjspace.contract import Array

_SIDES = 48  # of a cylinder
_FINENESS = 3  # of a sphere: 1280 triangles


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
    found: dict[tuple[float, ...], list[tuple[Array, NDArray[np.int_]]]] = {}
    units = {
        "cubes": trimesh.creation.box(),
        "cylinders": trimesh.creation.cylinder(0.5, 1.0, sections=_SIDES),
        "spheres": trimesh.creation.icosphere(_FINENESS, 0.5),
    }
    for kind, unit in units.items():
        for shape in getattr(entity, kind):
            size = np.array([shape.size.x, shape.size.y, shape.size.z])
            placed = _placed(shape.pose, size * unit.vertices)
            found.setdefault(_color(shape.color), []).append((placed, unit.faces))
    for shape in entity.triangles:
        points = np.array([(p.x, p.y, p.z) for p in shape.points]).reshape(-1, 3)
        faces = np.array(shape.indices, dtype=int).reshape(-1, 3)
        if faces.size and faces.max() >= len(points):
            raise ValueError(f"/scene: a mesh has {len(points)} vertices and no {faces.max()}")
        if faces.size:
            placed = _placed(shape.pose, points)
            found.setdefault(_color(shape.color), []).append((placed, faces))
    return [Mesh(*_joined(parts), color) for color, parts in found.items()]


def _joined(
    parts: list[tuple[Array, NDArray[np.int_]]],
) -> tuple[Array, NDArray[np.int_]]:
    firsts = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    faces = [of_part + first for first, (_, of_part) in zip(firsts, parts, strict=True)]
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate(faces)


def _placed(pose: Any, points: Array) -> Array:
    turn, place = pose.orientation, pose.position
    moved = rotate(np.array([turn.w, turn.x, turn.y, turn.z]), points)
    placed: Array = moved + np.array([place.x, place.y, place.z])
    return placed


def _color(color: Any) -> tuple[float, ...]:
    return color.r, color.g, color.b, color.a
