"""What a log holds for viewers: the geometry on /scene, and where every body is on /tf."""

from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.message import DecodeError

from mjspace.contract import Array
from mjspace.errors import InputError
from mjspace.log.content import read_content
from mjspace.log.encoding import HEADER
from mjspace.log.index import ChunkPlace, inventory
from mjspace.log.reader import Log
from mjspace.log.scene import REFERENCE

_TIME = HEADER.fields["log_time"][1]  # type: ignore[index]


class Poses(NamedTuple):
    """Where bodies are in ``world`` at one logged instant."""

    time: float
    """[s]"""
    names: tuple[str, ...]
    position: Array
    """[m], (bodies, 3)"""
    quaternion: Array
    """Body to world, scalar first, (bodies, 4)."""


def poses_of(path: Path, record: bytes) -> Poses:
    """Return what a Message record on /tf of the log at ``path`` tells.

    Raises:
        InputError: it is damaged.
    """
    frames = parsed(path, "/tf", FrameTransforms, record).transforms
    places = [(f.translation.x, f.translation.y, f.translation.z) for f in frames]
    turns = [(f.rotation.w, f.rotation.x, f.rotation.y, f.rotation.z) for f in frames]
    names = tuple(frame.child_frame_id for frame in frames)
    return Poses(
        _stamp(record) / 1e9, names, np.reshape(places, (-1, 3)), np.reshape(turns, (-1, 4))
    )


def parsed(path: Path, topic: str, kind: Any, record: bytes) -> Any:
    """Return the message of a ``kind`` in a Message record on a topic of the log at ``path``.

    Raises:
        InputError: it is damaged.
    """
    try:
        return kind.FromString(record[HEADER.itemsize :])
    except DecodeError as error:
        raise InputError(f"{path}: {topic} is damaged: {error}") from error


def _stamp(record: bytes) -> int:
    """Return the time of a Message record [ns]."""
    return int.from_bytes(record[_TIME : _TIME + 8], "little")


def bus_of(log: Log) -> str:
    """Return the name of the bus's frame: the one that is where /truth begins; "world" of none.

    Raises:
        InputError: the log is damaged.
    """
    truth = next(log.blocks("/truth", ["position", "attitude"]), None)
    for record in log.records("/tf"):
        found = poses_of(log.path, record)
        places = {
            name: np.concatenate([place, turn])
            for name, place, turn in zip(*found[1:], strict=True)
            if name != REFERENCE
        }
        if truth is None:
            return str(next(iter(places), "world"))
        begin: Array = np.concatenate([truth["position"][0], truth["attitude"][0]])
        away = {name: float(np.abs(place - begin).max()) for name, place in places.items()}
        return str(min(away, key=away.__getitem__))
    return "world"


class Frames:
    """The /scene and /tf of a log; of /tf the messages of at most three chunks are in memory.

    The model that flew is not needed: what is drawn is plain geometry.
    """

    def __init__(self, path: Path) -> None:
        """Open them.

        Raises:
            OSError: the file cannot be read.
            InputError: it is not a log of mjspace, is damaged, or holds no frames.
        """
        self._path = path
        found = inventory(path)
        if missing := [topic for topic in ("/scene", "/tf") if topic not in found.channels]:
            raise InputError(f"{path} has no {' and no '.join(missing)}: nothing to draw")
        self._scene, self._tf = (found.channels[topic].id for topic in ("/scene", "/tf"))
        self._chunks = found.chunks
        self._with_tf = [c for c in self._chunks if c.indexes is None or self._tf in c.indexes]
        self._near: tuple[ChunkPlace, ...] = ()
        self._records: list[bytes] = []
        self._stamps: list[int] = []

    def scene(self) -> Any:
        """Return the geometry, a ``foxglove.SceneUpdate``.

        Raises:
            InputError: there is none, or it is damaged.
        """
        for place in self._chunks:
            if place.indexes is None or self._scene in place.indexes:
                for record in self._read(place, self._scene, "/scene"):
                    return parsed(self._path, "/scene", SceneUpdate, record)
        raise InputError(f"{self._path} holds nothing on /scene")

    def at(self, time: float) -> Poses:
        """Return where the bodies are at the instant of /tf nearest to ``time`` [s].

        Raises:
            InputError: there is none, or it is damaged.
        """
        stamp = round(time * 1e9)
        # A chunk has frames of its own span alone, though not up to its ends: those around count.
        after = bisect_right(self._with_tf, stamp, key=lambda place: place.start)
        near = tuple(self._with_tf[max(after - 2, 0) : after + 1])
        if near != self._near or not near:
            records = [record for place in near for record in self._read(place, self._tf, "/tf")]
            if not records:
                raise InputError(f"{self._path} holds nothing on /tf near {time:g} s")
            self._near, self._records = near, records
            self._stamps = [_stamp(record) for record in records]
        best = min(range(len(self._stamps)), key=lambda i: abs(self._stamps[i] - stamp))
        found = poses_of(self._path, self._records[best])
        if not (np.isfinite(found.position).all() and np.isfinite(found.quaternion).all()):
            raise InputError(
                f"{self._path}: /tf has a number that is not finite at t = {found.time:g} s"
            )
        return found

    def _read(self, place: ChunkPlace, channel: int, topic: str) -> Iterator[bytes]:
        """Yield the channel's Message records in a chunk."""
        try:
            with self._path.open("rb") as file:
                content = read_content(file, place, [channel])
            if channel in content.channels:
                yield from content.records(channel)
        except ValueError as error:
            raise InputError(f"{self._path}: {topic} cannot be read: {error}") from error
