"""The moments of a log: what is drawn at any time, with a second of it in memory."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from mjspace.contract import Array
from mjspace.log.arrows import ARROWS
from mjspace.log.frames import Frames
from mjspace.log.reader import Log
from mjspace.view.scene import Moment, trail

_AHEAD = 1.0  # s that is read at once
_TRAIL_POINTS = 1000


class Survey(NamedTuple):
    """What a whole log tells about what is drawn of it."""

    longest: dict[str, float]
    """The largest norm of each arrow's vector, by its name."""
    path: tuple[Array, Array]
    """The trail: times [s] (n,) and points [m] (n, 3)."""


class Moments:
    """The moments of a log. Jumps to any time read the chunks there alone."""

    def __init__(self, log: Log) -> None:
        """Open its frames.

        Raises:
            InputError: it holds none, or is damaged.
        """
        self._log = log
        self.frames = Frames(log.path)
        wanted = {(arrow.topic, arrow.field) for arrow in ARROWS}
        wanted |= {("/reference", "attitude")}
        self._fields: dict[str, list[str]] = {}
        for topic, field in sorted(wanted):
            if field in log.topics.get(topic, {}):
                self._fields.setdefault(topic, []).append(field)
        self._rows: Mapping[str, Mapping[str, Array]] = {}
        self._span = (np.inf, -np.inf)

    def at(self, time: float) -> Moment:
        """Return the moment nearest to ``time`` [s].

        Raises:
            InputError: the log is damaged there.
        """
        if not self._span[0] <= time <= self._span[1]:
            self._read(time)
        found = {(a.topic, a.field): self._nearest(a.topic, a.field, time) for a in ARROWS}
        vectors = {a.name: found[a.topic, a.field] for a in ARROWS}
        return Moment(
            time,
            self.frames.at(time),
            self._nearest("/reference", "attitude", time),
            {name: vector for name, vector in vectors.items() if vector is not None},
        )

    def survey(self, size: float) -> Survey:
        """Return what the whole log tells, of a vehicle of that ``size`` [m]; it is read once."""
        log = self._log
        fields = {topic: list(names) for topic, names in self._fields.items()}
        flown = [f for f in ("position", "attitude") if f in log.topics.get("/truth", {})]
        if flown:
            fields["/truth"] = [*fields.get("/truth", []), *flown]
        every = max(1, len(log) // _TRAIL_POINTS)
        longest: dict[str, float] = {}
        samples: list[tuple[Array, Array, Array]] = []
        for block in log.blocks_of_topics(fields, every=every):
            for arrow in ARROWS:
                rows = block.get(arrow.topic, {}).get(arrow.field)
                if rows is not None and len(rows):
                    norm = float(np.nanmax(np.linalg.norm(rows, axis=1)))
                    longest[arrow.name] = max(longest.get(arrow.name, 0.0), norm)
            truth = block.get("/truth", {})
            if {"position", "attitude"} <= truth.keys():
                samples.append((truth["time"], truth["position"], truth["attitude"]))
        if not samples:
            return Survey(longest, (np.empty(0), np.empty((0, 3))))
        time, position, quaternion = map(np.concatenate, zip(*samples, strict=True))
        return Survey(longest, trail(time, position, quaternion, size))

    def _read(self, time: float) -> None:
        log = self._log
        margin = 2.0 * log.control_period * max(log.every[topic] for topic in self._fields)
        start = max(time - margin, 0.0)
        end = time + max(_AHEAD, margin)
        self._rows = log.read_topics(self._fields, start - margin, end + margin)
        self._span = start, end

    def _nearest(self, topic: str, field: str, time: float) -> Array | None:
        rows = self._rows.get(topic, {})
        if field not in rows or not len(rows["time"]):
            return None
        value: Array = rows[field][int(np.abs(rows["time"] - time).argmin())]
        return value if np.isfinite(value).all() else None
