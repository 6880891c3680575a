"""What is drawn around a vehicle at each instant of a log, and what the legend says of it."""

from collections.abc import Iterator
from math import ceil
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.log.reader import Log
from mjspace.rendering.arrows import arrows_of
from mjspace.rendering.captions import flies_a_path, is_lander
from mjspace.rendering.markers import TRAIL_POINTS
from mjspace.rendering.scene import Decoration

Lines = list[tuple[tuple[float, float, float], str, str]]
"""Of a legend: color, letter and text of each."""


def decorations(log: Log, law: str, model: Any, times: Array) -> Iterator[tuple[Decoration, Lines]]:
    """Yield what is drawn at each of the ascending ``times`` (n,) [s], and the legend's lines.

    A vehicle that flies a path has a trail, and a lander the site: where its desired path ends.
    """
    arrows = arrows_of(log, law, model, times)
    when, path = _path(log, float(times[-1]))
    site = _site(log)
    for number, time in enumerate(times):
        flown = path[: int(np.searchsorted(when, time))]
        drawn = [(each.kind, each.length(number)) for each in arrows]
        lines = [(each.kind.color, each.kind.letter, each.legend(number)) for each in arrows]
        yield Decoration(drawn, flown, site), lines


def _path(log: Log, end: float) -> tuple[Array, Array]:
    """Return times (k,) [s] and places (k, 3) [m] of a path that is flown; none of another."""
    if not flies_a_path(log):
        return np.empty(0), np.empty((0, 3))
    periods = max(1.0, (end - log.start) / log.control_period)
    every = ceil(periods / (TRAIL_POINTS * log.every["/truth"]))
    rows = log.read("/truth", ["position"], end=end, every=every)
    return rows["time"], rows["position"]


def _site(log: Log) -> Array | None:
    """Return where the desired path of a lander ends, x and y (2,) [m]."""
    if not is_lander(log) or "position" not in log.topics.get("/reference", {}):
        return None
    end: Array = log.nearest("/reference", log.end)["position"][:2]
    return end
