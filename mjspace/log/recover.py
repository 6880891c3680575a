"""What can be saved of a damaged log: every whole chunk, and what explains it, in a new file."""

import math
from collections import Counter
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjspace.errors import InputError, input_error_at
from mjspace.log import digest
from mjspace.log.checked import CONTROL_PERIOD, event, number, span, stamps
from mjspace.log.chunk import INDEX, Part
from mjspace.log.content import Content, message_offsets, unpacked
from mjspace.log.encoding import HEADER, doubles
from mjspace.log.file import NAME, LogFile
from mjspace.log.index import ChunkPlace
from mjspace.log.salvage import Salvage, salvage
from mjspace.log.schema import PERIODIC, Shapes, declared

_EVENTS = "/events"


class Recovered(NamedTuple):
    """What was saved, and what was not."""

    chunks: int
    start: float
    """Of the first chunk's stamps [s]."""
    end: float
    """Of the last chunk's [s]."""
    attachments: list[str]
    lost_bytes: int
    lost_spans: list[tuple[float, float]]
    """From the last control period before to the first after each gap [s]; inf: to the end."""
    lost_attachments: list[str]
    lost_metadata: list[str]
    """Keys that were left out because the rows contradict them."""
    lost_topics: list[str]
    """Topics that were left out because mjspace would not read them."""

    @property
    def lost(self) -> str:
        """What was lost, in words; empty where nothing was."""
        spans = [
            f"after {a:g} s" if b == math.inf else f"between {a:g} and {b:g} s"
            for a, b in self.lost_spans
        ]
        parts = [f"attachment {name}" for name in self.lost_attachments]
        parts += [f"metadata {key}" for key in self.lost_metadata]
        parts += self.lost_topics
        count = [f"{self.lost_bytes:,} bytes"] if self.lost_bytes or spans else []
        return ", ".join([*count, *spans, *parts])


class _Kept(NamedTuple):
    place: ChunkPlace
    ends: tuple[np.void, np.void] | None
    """Headers of the first and the last row of the topic that is logged most often."""


def recover(path: Path, out: Path) -> Recovered:
    """Write what can be saved of the log at ``path`` as a new one at ``out``.

    It has all whole chunks in the order of time, the metadata, the attachments and a new summary.
    The time is proportional to the file's size, and one chunk is in memory at a time.

    Raises:
        OSError: a file cannot be read or written.
        InputError: ``out`` exists, or nothing of a flight can be saved.
    """
    if out.exists():
        raise InputError(f"{out} exists: name a file that does not")
    with input_error_at("log"):
        found = salvage(path)
    lost_topics = _unreadable_topics(path, found)
    found = found._replace(
        channels={t: c for t, c in found.channels.items() if t not in lost_topics}
    )
    topics: dict[str, tuple[Shapes, dict[str, str], int]] = {}
    for topic in PERIODIC:
        if topic in found.channels:
            channel = found.channels[topic]
            try:
                topics[topic] = declared(channel, found.schemas.get(channel.schema_id))
            except ValueError as error:
                raise InputError(f"{path}: {topic} is not as mjspace logs it: {error}") from error
    dtypes = {found.channels[t].id: doubles(s).record(0).dtype for t, (s, *_) in topics.items()}
    every = {found.channels[topic].id: every for topic, (*_, every) in topics.items()}
    most_often = min(every, key=every.__getitem__, default=-1)
    kept, lost_bytes = _in_order(path, found, dtypes, most_often)
    if not any(one.ends for one in kept):
        raise InputError(f"{path}: nothing of a flight can be saved: it has no whole chunk")
    lost_metadata = _wrong_period(path, found, kept)
    result = Recovered(
        len(kept),
        min(one.place.start for one in kept) / 1e9,
        max(one.place.end for one in kept) / 1e9,
        list(found.attachments),
        lost_bytes,
        _gaps(kept, every[most_often], found),
        sorted(found.expected_attachments - found.attachments.keys()),
        lost_metadata,
        lost_topics,
    )
    _write(path, out, found, kept, result)
    return result


def _unreadable_topics(path: Path, found: Salvage) -> list[str]:
    """Return the topics that are declared on one channel, and /events if an entry is none."""
    shared = Counter(channel.id for channel in found.channels.values())
    unreadable = [topic for topic, channel in found.channels.items() if shared[channel.id] > 1]
    if _EVENTS not in unreadable and not _readable_events(path, found):
        unreadable.append(_EVENTS)
    return unreadable


def _readable_events(path: Path, found: Salvage) -> bool:
    """Tell whether all entries of /events are that: another topic's channel may have its name."""
    if _EVENTS not in found.channels:
        return True
    channel = found.channels[_EVENTS].id
    with path.open("rb") as file:
        for place in found.chunks:
            data = unpacked(file, place)
            content = Content(data, message_offsets(data, [channel]))
            try:
                for one in content.channels:  # none, in a chunk without events
                    for record in content.records(one):
                        event(record)
            except ValueError:
                return False
    return True


def _in_order(
    path: Path, found: Salvage, dtypes: Mapping[int, np.dtype[np.void]], most_often: int
) -> tuple[list[_Kept], int]:
    """Return the chunks that are kept, in the order of time, and how many bytes were lost."""
    kept, lost = [], found.lost_bytes
    known = {channel.id for channel in found.channels.values()}
    last = dict.fromkeys(dtypes, -1)
    with path.open("rb") as file:
        for place in sorted(found.chunks, key=lambda place: (place.start, place.position)):
            data = unpacked(file, place)
            content = Content(data, message_offsets(data, known))
            try:
                headers = {
                    channel: content.rows(channel, dtypes[channel])["header"]
                    for channel in content.channels
                    if channel in dtypes
                }
                for channel, header in headers.items():
                    stamps(header["log_time"], place)
                    if header["log_time"][0] <= last[channel]:
                        raise ValueError("time does not go on")
            except ValueError:
                lost += place.size
                continue
            if not content.channels:
                continue
            last |= {channel: int(header["log_time"][-1]) for channel, header in headers.items()}
            rows = headers.get(most_often)
            kept.append(_Kept(place, None if rows is None else (rows[0].copy(), rows[-1].copy())))
    return kept, lost


def _wrong_period(path: Path, found: Salvage, kept: list[_Kept]) -> list[str]:
    """Return the metadata's key of the control period where it does not fit the ``kept`` rows."""
    metadata = found.metadata.get(NAME, {})
    if CONTROL_PERIOD not in metadata:
        return []
    ends = [one.ends for one in kept if one.ends]
    try:
        period = number(path, metadata, CONTROL_PERIOD, above=0.0)
        span(path, "", ends[0][0], ends[-1][1], period)
    except InputError:
        return [CONTROL_PERIOD]
    return []


def _gaps(kept: list[_Kept], every: int, found: Salvage) -> list[tuple[float, float]]:
    """Return where control periods are missing between the ``kept`` chunks, and after them."""
    flown = [one.ends for one in kept if one.ends]
    begin, end = flown[0][0], flown[-1][1]
    gaps = [(0.0, begin["log_time"] / 1e9)] if begin["sequence"] else []
    for (_, before), (after, _) in pairwise(flown):
        if int(after["sequence"]) > int(before["sequence"]) + every:
            gaps.append((before["log_time"] / 1e9, after["log_time"] / 1e9))
    if found.lost_at_end:
        gaps.append((end["log_time"] / 1e9, math.inf))
    return gaps


def _write(path: Path, out: Path, found: Salvage, kept: list[_Kept], result: Recovered) -> None:
    notes = dict(found.metadata)
    own = {k: v for k, v in notes.pop(NAME, {}).items() if k not in result.lost_metadata}
    if result.lost:
        own["recovered"] = f"lost {result.lost}"
    log = LogFile(
        out,
        list(found.schemas.values()),
        list(found.channels.values()),
        own,
        found.attachments,
    )
    try:
        with path.open("rb") as file:
            for one in kept:
                log.add_chunk([_part(unpacked(file, one.place), found)])
        if result.lost:
            notes.pop(digest.RECORD, None)
        for name, metadata in notes.items():
            log.add_metadata(name, metadata)
        log.close()
    except BaseException:
        out.unlink()
        raise


def _part(data: bytes, found: Salvage) -> Part:
    """Return the messages of a chunk on known channels, and where each channel's are."""
    offsets = message_offsets(data, {channel.id for channel in found.channels.values()})
    content = bytearray()
    entries: dict[int, NDArray[np.void]] = {}
    for channel, places in offsets.items():
        if not len(places):
            continue
        records = Content(data, {channel: places}).records(channel)
        entries[channel] = np.empty(len(records), INDEX)
        sizes = np.array([len(record) for record in records], np.uint64)
        entries[channel]["offset"] = len(content) + np.cumsum(sizes) - sizes
        content += b"".join(records)
    whole = np.frombuffer(content, np.uint8)
    at = HEADER.fields["log_time"][1]  # type: ignore[index]
    for entry in entries.values():
        columns = entry["offset"].astype(np.int64)[:, None] + at + np.arange(8)
        entry["time"] = whole[columns].view("<u8")[:, 0]
    return Part(whole, entries)
