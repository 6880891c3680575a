"""The blueprint of a recording of Rerun: a view that follows the bus, and plots of what flew."""

import math
from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from mjspace.log.foxglove_layout import plots_of
from mjspace.log.reader import Log

WORLD = "world"
"""The entity of what is drawn, and the frame that all others are in."""
FOLLOW = f"{WORLD}/follow"
"""The entity of the frame that moves with the bus but does not turn."""
_COLUMNS = 2  # of plots, beside the view
_FROM = np.array([2.0, -0.85, 0.7])  # where the eye is, over the vehicle's extent


def blueprint(log: Log, fields: Collection[tuple[str, str]], reach: float) -> Any:
    """Return the ``rerun.blueprint.Blueprint`` of a log.

    ``fields`` are the topics and fields that are in the recording. What is drawn is seen from
    ``FOLLOW``, from where a vehicle that reaches so far [m] is seen whole.
    """
    import rerun.blueprint as rrb

    view = rrb.Spatial3DView(
        origin=f"/{FOLLOW}",
        contents=f"/{WORLD}/**",
        name="Vehicle",
        eye_controls=rrb.EyeControls3D(
            position=_FROM * reach, look_target=[0.0, 0.0, 0.0], eye_up=[0.0, 0.0, 1.0]
        ),
        line_grid=False,
        background=[24, 28, 36],
    )
    plots = list(_plots(rrb, log, fields))
    rows = math.ceil(len(plots) / _COLUMNS)
    columns = [rrb.Vertical(*plots[i : i + rows]) for i in range(0, len(plots), max(rows, 1))]
    left = rrb.Vertical(view, rrb.TextLogView(origin="/events", name="Events"), row_shares=[4, 1])
    return rrb.Blueprint(
        rrb.Horizontal(left, *columns, column_shares=[3, *(2 for _ in columns)]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline="time"),
        auto_views=False,
    )


def _plots(rrb: Any, log: Log, fields: Collection[tuple[str, str]]) -> Iterator[Any]:
    for plot in plots_of(log.topics):
        if (plot.topic, plot.field) in fields:
            unit = log.units.get(plot.topic, {}).get(plot.field)
            yield rrb.TimeSeriesView(
                origin=f"{plot.topic}/{plot.field}",
                name=f"{plot.title} [{unit}]" if unit else plot.title,
                axis_x=rrb.TimeAxis(view_range=_whole(log)),
                plot_legend=rrb.PlotLegend(visible=len(plot.paths) > 1),
            )


def _whole(log: Log) -> Any:
    """Return the span of a log as a ``rerun.TimeRange``."""
    from rerun import TimeRange, TimeRangeBoundary

    ends = (TimeRangeBoundary.absolute(seconds=seconds) for seconds in (log.start, log.end))
    return TimeRange(*ends)
