"""What a log has for viewers: the shapes of each body, and where its frames were."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from mjspace.contract import Array
from mjspace.log.frames import parsed, poses_of
from mjspace.log.reader import Log


class Frames(NamedTuple):
    """Where a frame was in ``world``."""

    time: Array
    """s, shape (n,)."""
    position: Array
    """m, shape (n, 3)."""
    quaternion: Array
    """Frame to world, scalar first, shape (n, 4)."""


def shapes_of(log: Log) -> dict[str, Any]:
    """Return the ``foxglove.SceneEntity`` of each frame, from /scene.

    Raises:
        InputError: the log is damaged.
    """
    records = log.records("/scene")
    updates = [parsed(log.path, "/scene", SceneUpdate, record) for record in records]
    return {entity.frame_id: entity for update in updates for entity in update.entities}


def frames_of(log: Log) -> Mapping[str, Frames]:
    """Return where each frame was, from /tf.

    Raises:
        InputError: the log is damaged.
    """
    rows: dict[str, list[tuple[float, ...]]] = {}
    for record in log.records("/tf"):
        found = poses_of(log.path, record)
        for name, place, turn in zip(*found[1:], strict=True):
            rows.setdefault(name, []).append((found.time, *place, *turn))
    numbers = {name: np.array(found) for name, found in rows.items()}
    return {name: Frames(n[:, 0], n[:, 1:4], n[:, 4:]) for name, n in numbers.items()}


def extent(shapes: Mapping[str, Any], frames: Mapping[str, Frames], bus: str) -> float:
    """Return how far the shapes of moving bodies reach from the bus at the start [m]; 1 of none."""
    reach = [0.0]
    middle = frames[bus].position[0] if bus in frames else np.zeros(3)
    for name, each in frames.items():
        entity, away = shapes.get(name), float(np.linalg.norm(each.position[0] - middle))
        if entity is None:
            continue
        for shape in (*entity.cubes, *entity.spheres, *entity.cylinders):
            reach.append(away + _norm(shape.pose.position) + 0.5 * _norm(shape.size))
        for mesh in entity.triangles:
            reach += [away + _norm(mesh.pose.position) + _norm(point) for point in mesh.points]
    return max(reach) or 1.0


def _norm(vector: Any) -> float:
    return math.hypot(vector.x, vector.y, vector.z)
