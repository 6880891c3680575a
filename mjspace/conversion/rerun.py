"""A log as a recording of Rerun: curves with their units, shapes that move, panels laid out."""

import errno
import hashlib
from collections.abc import Callable, Iterator, Mapping
from typing import Any, BinaryIO

import numpy as np

from mjspace.attitude import rotate
from mjspace.contract import Array
from mjspace.conversion.arrows import Arrows, arrows_of
from mjspace.conversion.rerun_layout import FOLLOW, WORLD, blueprint
from mjspace.conversion.shown import Frames, extent, frames_of, shapes_of
from mjspace.errors import missing
from mjspace.log.columns import Signal, blocks
from mjspace.log.frames import bus_of
from mjspace.log.reader import Log
from mjspace.plotting.style import COLORS

Rows = dict[str, dict[str, Array]]
"""Of each topic ``time`` [s], (n,), and the fields, (n, ...)."""

_TIMELINE = "time"
_THICKNESS = 0.012  # radius of an arrow, over the vehicle's reach
_BATCH = 20_000  # rows of a curve's part
_LEVELS = {"WARNING": "WARN"}  # Rerun's names of levels, where they are others


def write(
    log: Log, file: BinaryIO, chosen: list[Signal], every: int, progress: Callable[[float], None]
) -> None:
    """Write the ``chosen`` signals, the shapes, their frames and the events as a recording (.rrd).

    An entity for each field, ``truth/rate``, with a curve for each of its numbers, named
    ``rate[0] [rad/s]``; ``world/bus`` and so on for bodies. Times are those of the log.

    Raises:
        InputError: the log is damaged, or Rerun's library is not installed.
        OSError: the file cannot be written to its end.
    """
    rr = rerun_for("A recording of Rerun (.rrd)")
    # Without properties: they have the wall clock's time.
    recording = rr.RecordingStream("mjspace", recording_id=_identity(log), send_properties=False)
    recording.set_log_time_enabled(False)
    recording.set_log_tick_enabled(False)
    recording.save(file.name)
    try:
        _add_all(rr, recording, log, chosen, every, progress)
        recording.flush()
    except RuntimeError as error:
        raise OSError(errno.EIO, f"not written to its end: {error}") from error
    finally:
        recording.disconnect()  # with the index at the file's end


def rerun_for(purpose: str) -> Any:
    """Return the library ``rerun``, for the ``purpose`` that an error names.

    Raises:
        InputError: it is not installed, with what installs it.
    """
    try:
        import rerun
        import rerun.blueprint
    except ImportError:
        raise missing(purpose, "rerun-sdk", "rerun") from None
    return rerun


def _identity(log: Log) -> str:
    """Return what is the same for the same flight, and for another flight another."""
    said = "\n".join(f"{key}={value}" for key, value in sorted(log.metadata.items()))
    return hashlib.sha256(said.encode()).hexdigest()[:32]


def _add_all(
    rr: Any,
    recording: Any,
    log: Log,
    chosen: list[Signal],
    every: int,
    progress: Callable[[float], None],
) -> None:
    recording.send_recording_name(log.metadata.get("scenario", log.path.stem))
    shapes, frames, bus = shapes_of(log), frames_of(log), bus_of(log)
    reach = extent(shapes, frames, bus)
    fields = {(signal.topic, signal.field) for signal in chosen}
    recording.send_blueprint(blueprint(log, fields, reach))
    _add_shapes(rr, recording, shapes, frames, bus)
    place = f"{WORLD}/{bus}/arrows"
    _add_arrows(rr, recording, place, arrows_of(log, frames, bus, reach), _THICKNESS * reach)
    _add_events(rr, recording, log)
    palette = np.array([int(f"{color[1:]}ff", 16) for color in COLORS], np.uint32)
    for signal in chosen:
        names = [_name(log, signal, column) for column in signal.columns]
        colors = np.resize(palette, len(names))
        recording.log(_path(signal), rr.SeriesLines(names=names, colors=colors), static=True)
    for found in _batches(blocks(log, chosen, every)):
        for signal in chosen:
            if signal.topic in found:
                rows = found[signal.topic]
                _add_curves(rr, recording, signal, rows["time"], signal.of(rows[signal.field]))
        progress(max(float(rows["time"][-1]) for rows in found.values()))


def _path(signal: Signal) -> str:
    return f"{signal.topic}/{signal.field}"


def _name(log: Log, signal: Signal, column: str) -> str:
    unit = log.units.get(signal.topic, {}).get(signal.field)
    name = column.removeprefix(f"{signal.topic[1:]}.")
    return f"{name} [{unit}]" if unit else name


def _times(rr: Any, time: Array) -> list[Any]:
    stamps = np.rint(np.asarray(time) * 1e9).astype("timedelta64[ns]")
    return [rr.TimeColumn(_TIMELINE, duration=stamps)]


def _add_curves(rr: Any, recording: Any, signal: Signal, time: Array, values: Array) -> None:
    """Add a signal's ``values`` (n, k) at ``time`` (n,) [s]."""
    columns = rr.Scalars.columns(scalars=values.ravel())
    if values.shape[1] > 1:
        columns = columns.partition(np.full(len(values), values.shape[1]))
    recording.send_columns(_path(signal), _times(rr, time), columns)


def _batches(found: Iterator[Rows]) -> Iterator[Rows]:
    """Yield the blocks of a log joined to ``_BATCH`` rows and more: Rerun is slow with many."""
    parts: list[Rows] = []
    count = 0
    for block in found:
        parts.append(block)
        count += max(len(rows["time"]) for rows in block.values())
        if count >= _BATCH:
            yield _joined(parts)
            parts, count = [], 0
    if parts:
        yield _joined(parts)


def _joined(parts: list[Rows]) -> Rows:
    topics = dict.fromkeys(topic for part in parts for topic in part)
    of_topic = {topic: [part[topic] for part in parts if topic in part] for topic in topics}
    return {
        topic: {name: np.concatenate([rows[name] for rows in found]) for name in found[0]}
        for topic, found in of_topic.items()
    }


def _add_events(rr: Any, recording: Any, log: Log) -> None:
    for event in log.events():
        recording.set_time(_TIMELINE, duration=event.time)
        level = _LEVELS.get(event.level, event.level)
        recording.log("events", rr.TextLog(event.message, level=level))
    recording.reset_time()


def _add_shapes(
    rr: Any, recording: Any, shapes: Mapping[str, Any], frames: Mapping[str, Frames], bus: str
) -> None:
    """Add each body's shapes once, and where they were."""
    recording.log(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for body, entity in shapes.items():
        for name, archetype in _archetypes(rr, entity):
            recording.log(f"{WORLD}/{body}/{name}", archetype, static=True)
    for body, each in frames.items():
        _add_frames(rr, recording, f"{WORLD}/{body}", each)
    if bus in frames:
        upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(frames[bus].time), 1))
        _add_frames(rr, recording, FOLLOW, frames[bus]._replace(quaternion=upright))


def _add_arrows(rr: Any, recording: Any, place: str, found: list[Arrows], radius: float) -> None:
    for each in found:
        path = f"{place}/{each.name.replace(' ', '_')}"
        shown = rr.Arrows3D.from_fields(colors=[each.color], radii=[radius])
        recording.log(path, shown, static=True)
        count = np.full(len(each.time), each.vector.shape[1])
        columns = rr.Arrows3D.columns(
            vectors=each.vector.reshape(-1, 3), origins=each.origin.reshape(-1, 3)
        )
        recording.send_columns(path, _times(rr, each.time), columns.partition(count))


def _add_frames(rr: Any, recording: Any, path: str, frames: Frames) -> None:
    columns = rr.Transform3D.columns(
        translation=frames.position, quaternion=frames.quaternion[:, [1, 2, 3, 0]]
    )
    recording.send_columns(path, _times(rr, frames.time), columns)


def _archetypes(rr: Any, entity: Any) -> Iterator[tuple[str, Any]]:
    """Yield what Rerun draws of a ``foxglove.SceneEntity``, with a name for each."""
    solid = rr.components.FillMode.Solid
    for name, drawn in (("boxes", entity.cubes), ("ellipsoids", entity.spheres)):
        if drawn:
            kind = rr.Boxes3D if name == "boxes" else rr.Ellipsoids3D
            half = [[0.5 * s.size.x, 0.5 * s.size.y, 0.5 * s.size.z] for s in drawn]
            yield name, kind(half_sizes=half, fill_mode=solid, **_placed(drawn))
    if entity.cylinders:
        # Rerun's cylinders are round, as those of the log.
        radii = [0.5 * shape.size.x for shape in entity.cylinders]
        lengths = [shape.size.z for shape in entity.cylinders]
        yield (
            "cylinders",
            rr.Cylinders3D(
                lengths=lengths, radii=radii, fill_mode=solid, **_placed(entity.cylinders)
            ),
        )
    for number, mesh in enumerate(entity.triangles):
        yield f"mesh_{number}", _mesh(rr, mesh)


def _placed(shapes: Any) -> dict[str, Any]:
    poses = [shape.pose for shape in shapes]
    at, turns = [p.position for p in poses], [p.orientation for p in poses]
    return {
        "centers": [[p.x, p.y, p.z] for p in at],
        "quaternions": [[q.x, q.y, q.z, q.w] for q in turns],
        "colors": [_color(shape) for shape in shapes],
    }


def _color(shape: Any) -> list[int]:
    color = shape.color
    return [round(255 * part) for part in (color.r, color.g, color.b, color.a)]


def _mesh(rr: Any, mesh: Any) -> Any:
    """Return a mesh whose faces are flat: each has its own vertices, and its normal at them."""
    place = mesh.pose.position, mesh.pose.orientation
    at = np.array([place[0].x, place[0].y, place[0].z])
    turn = np.array([place[1].w, place[1].x, place[1].y, place[1].z])
    points = np.array([[p.x, p.y, p.z] for p in mesh.points])
    corners = at + rotate(turn, points[np.array(mesh.indices, int)])
    a, b, c = corners.reshape(-1, 3, 3).swapaxes(0, 1)
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    return rr.Mesh3D(
        vertex_positions=corners,
        vertex_normals=np.repeat(normals, 3, axis=0),
        albedo_factor=_color(mesh),
    )
