"""Charts as plain data for a page's script: lines over time, histograms, scatters."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.errors import printable

_FLAT = 1e-3
"""A signal that varies by less than this of its size is stored as the difference from its mean."""


@dataclass(frozen=True)
class Series:
    """A line, or the points of a scatter."""

    name: str
    x: Array
    """(n,), ascending for a line."""
    y: Array
    """(n,)"""
    color: int | None
    """Index into the page's colors; None for ink."""
    dash: int = 0
    """Index into the page's dashes; 0 is a solid line."""
    desired: bool = False
    """Whether it is the desired value, drawn broad and faint."""


@dataclass(frozen=True)
class Bound:
    """A straight line: the bound of a check over its window, or across a histogram."""

    text: str
    start: tuple[float, float]
    end: tuple[float, float]
    color: int | None = None


@dataclass(frozen=True)
class Chart:
    """What the page draws in one frame."""

    title: str
    y: str
    """Label of the vertical axis: the unit, as a rule."""
    series: Sequence[Series]
    kind: str = "lines"
    """``lines``, ``bars`` or ``points``."""
    x: str = "time [s]"
    log_scale: bool = False
    bounds: Sequence[Bound] = field(default=())


def data(charts: Sequence[Chart]) -> dict[str, Any]:
    """Return the charts as JSON can hold them; arrays that several series share are there once."""
    arrays: list[dict[str, Any]] = []
    known: dict[bytes, int] = {}

    def number(values: Array, log_scale: bool) -> int:
        packed = _packed(values, log_scale)
        key = f"{packed['base']} {packed['data']}".encode()
        if key not in known:
            known[key] = len(arrays)
            arrays.append(packed)
        return known[key]

    drawn = [
        {
            "title": printable(chart.title),
            "x": printable(chart.x),
            "y": printable(chart.y),
            "kind": chart.kind,
            "log": chart.log_scale,
            "series": [
                {
                    "name": printable(one.name),
                    "x": number(one.x, False),
                    "y": number(one.y, chart.log_scale),
                    "color": one.color,
                    "dash": one.dash,
                    "desired": one.desired,
                }
                for one in chart.series
            ],
            "bounds": [
                {
                    "text": printable(bound.text),
                    "from": [_finite(each) for each in bound.start],
                    "to": [_finite(each) for each in bound.end],
                    "color": bound.color,
                }
                for bound in chart.bounds
            ],
        }
        for chart in charts
    ]
    return {"arrays": arrays, "charts": drawn}


def _packed(values: Array, log_scale: bool) -> dict[str, Any]:
    """Return the values (n,) as a base and single-precision differences from it, in base64."""
    finite = values[np.isfinite(values)]
    base = 0.0
    if len(finite) and not log_scale:
        low, high = float(finite.min()), float(finite.max())
        if high - low < _FLAT * max(abs(low), abs(high)):
            base = low
    with np.errstate(over="ignore"):  # what is out of range is drawn as a gap
        single = (values - base).astype("<f4")
    return {"base": base, "data": base64.b64encode(single.tobytes()).decode()}


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
