"""A copy of a log with arrows, and with a video if wanted, for Foxglove, Lichtblick and Rerun."""

import heapq
from collections.abc import Callable, Iterator
from typing import Any, BinaryIO

import numpy as np
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from mjspace.contract import Array
from mjspace.conversion.arrows import Arrows, arrows_of
from mjspace.conversion.shown import extent, frames_of, shapes_of
from mjspace.log.copy import copy_with
from mjspace.log.frames import bus_of
from mjspace.log.reader import Log
from mjspace.rendering.render import frames_at
from mjspace.rendering.video import access_units

ARROWS, VIDEO = "/arrows", "/video"
RATE = 25  # frames a second
_SIZE = 960, 540  # of a frame, in pixels
_THICKNESS = 0.03  # of a shaft, over the vehicle's reach

Messages = Iterator[tuple[str, int, bytes]]
"""Topic, stamp [ns] and message, in the order of time."""


def write(log: Log, file: BinaryIO, camera: str | None, progress: Callable[[float], None]) -> None:
    """Write the log with /arrows, and /video through ``camera`` where one is named.

    /arrows are ``foxglove.SceneUpdate``, at most 20 a second; /video is
    ``foxglove.CompressedVideo`` in H.264 of 25 frames a second, a key frame in each second.

    Raises:
        ValueError: an unknown camera, or the log is damaged.
        NoRendererError: this machine cannot render; the message says what to install.
    """
    shapes, frames = shapes_of(log), frames_of(log)
    bus = bus_of(log)
    reach = extent(shapes, frames, bus)
    kinds: dict[str, Any] = {ARROWS: SceneUpdate}
    found = arrows_of(log, frames, bus, reach)
    added = [_drawn(each, bus, _THICKNESS * reach) for each in found]
    if camera is not None:
        kinds[VIDEO] = CompressedVideo
        added.append(_video(log, camera, progress))
    copy_with(log.path, file, kinds, heapq.merge(*added, key=lambda each: each[1]))


def _drawn(arrows: Arrows, bus: str, thickness: float) -> Messages:
    """Yield the arrows of one kind: an entity that each message replaces."""
    for time, origins, vectors in zip(arrows.time, arrows.origin, arrows.vector, strict=True):
        stamp = round(float(time) * 1e9)
        update = SceneUpdate()
        entity = update.entities.add(frame_id=bus, id=arrows.name, frame_locked=True)
        entity.timestamp.FromNanoseconds(stamp)
        for origin, vector in zip(origins, vectors, strict=True):
            length = float(np.linalg.norm(vector))
            if length > 0.0:
                _add(entity.arrows.add(), origin, vector / length, length, thickness, arrows.color)
        yield ARROWS, stamp, update.SerializeToString()


def _add(
    arrow: Any,
    origin: Array,
    along: Array,
    length: float,
    thickness: float,
    color: tuple[int, int, int],
) -> None:
    head = min(4.0 * thickness, 0.5 * length)
    arrow.shaft_length, arrow.head_length = length - head, head
    arrow.shaft_diameter, arrow.head_diameter = thickness, 2.5 * thickness
    at, turn = arrow.pose.position, arrow.pose.orientation
    at.x, at.y, at.z = origin.tolist()
    turn.w, turn.x, turn.y, turn.z = _from_x(along).tolist()
    arrow.color.r, arrow.color.g, arrow.color.b = (part / 255.0 for part in color)
    arrow.color.a = 1.0


def _from_x(along: Array) -> Array:
    """Return the shortest rotation (4,) from the x axis to a unit vector (3,)."""
    half = np.array([1.0 + along[0], 0.0, -along[2], along[1]])
    norm = float(np.linalg.norm(half))
    return half / norm if norm > 1e-9 else np.array([0.0, 0.0, 0.0, 1.0])


def _video(log: Log, camera: str, progress: Callable[[float], None]) -> Messages:
    times = np.arange(log.start, log.end + 1e-9, 1.0 / RATE)
    pictures = frames_at(log, times, camera, _SIZE)
    for time, unit in zip(times, access_units(pictures, _SIZE, RATE), strict=True):
        stamp = round(float(time) * 1e9)
        message = CompressedVideo(frame_id=camera, data=unit, format="h264")
        message.timestamp.FromNanoseconds(stamp)
        progress(float(time))
        yield VIDEO, stamp, message.SerializeToString()
