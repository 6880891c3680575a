"""What a log has for viewers: the shapes of each body, and where its frames were."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.message import DecodeError

from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.log.encoding import HEADER
from mjspace.log.reader import Log
from mjspace.log.scene import REFERENCE


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
    updates = [_parsed(log, "/scene", SceneUpdate, record) for record in log.records("/scene")]
    return {entity.frame_id: entity for update in updates for entity in update.entities}


def frames_of(log: Log) -> Mapping[str, Frames]:
    """Return where each frame was, from /tf.

    Raises:
        InputError: the log is damaged.
    """
    rows: dict[str, list[tuple[float, ...]]] = {}
    for record in log.records("/tf"):
        for each in _parsed(log, "/tf", FrameTransforms, record).transforms:
            rows.setdefault(each.child_frame_id, []).append(_row(each))
    numbers = {name: np.array(found) for name, found in rows.items()}
    return {name: Frames(n[:, 0], n[:, 1:4], n[:, 4:]) for name, n in numbers.items()}


def bus_of(log: Log) -> str:
    """Return the name of the bus's frame: the one that is where /truth begins; "world" of none.

    Raises:
        InputError: the log is damaged.
    """
    truth = next(log.blocks("/truth", ["position", "attitude"]), None)
    for record in log.records("/tf"):
        found = _parsed(log, "/tf", FrameTransforms, record).transforms
        places = {
            each.child_frame_id: np.array(_row(each)[1:])
            for each in found
            if each.child_frame_id != REFERENCE
        }
        if truth is None:
            return str(next(iter(places), "world"))
        begin: Array = np.concatenate([truth["position"][0], truth["attitude"][0]])
        away = {name: float(np.abs(place - begin).max()) for name, place in places.items()}
        return str(min(away, key=away.__getitem__))
    return "world"


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


def _row(each: Any) -> tuple[float, ...]:
    """Return the time, position and quaternion of a ``foxglove.FrameTransform``."""
    time = each.timestamp.seconds + each.timestamp.nanos * 1e-9
    at, turn = each.translation, each.rotation
    return time, at.x, at.y, at.z, turn.w, turn.x, turn.y, turn.z


def _norm(vector: Any) -> float:
    return math.hypot(vector.x, vector.y, vector.z)


def _parsed(log: Log, topic: str, kind: Any, record: bytes) -> Any:
    try:
        return kind.FromString(record[HEADER.itemsize :])
    except DecodeError as error:
        raise InputError(f"{log.path}: {topic} is not {kind.DESCRIPTOR.full_name}") from error
