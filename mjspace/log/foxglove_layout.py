"""The layout of Foxglove and Lichtblick for a log: a 3D view, events, plots of what flew."""

import json
import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

Topics = Mapping[str, Mapping[str, tuple[int, ...]]]

SIGNALS = (
    ("Height above the ground", "/truth", "altitude"),
    ("Velocity", "/truth", "velocity"),
    ("Thrust", "/truth", "thrust"),
    ("Propellant", "/truth", "propellant"),
    ("Attitude error", "/truth", "attitude_error"),
    ("Body rate", "/truth", "rate"),
    ("Commanded torque", "/command", "torque"),
    ("Wheel speed", "/truth", "wheel_speed"),
    ("Gimbal angle", "/truth", "gimbal_angle"),
    ("Gimbal rate", "/command", "gimbal_rate"),
    ("Thrusters on", "/command", "on_time"),
    ("Magnetic moment", "/command", "magnetic_moment"),
    ("Motor torque", "/command", "motor_torque"),
    ("Joint torque", "/command", "applied_joint_torque"),
)
"""Title, topic and field of what is plotted, if it is in the log, the first before the others."""
MOST = 8
"""Plots."""
_ONLY_ON_GROUND = {"velocity"}
_CURVES = 12  # in a plot


class Plot(NamedTuple):
    """What a plot shows of a field of a topic."""

    title: str
    topic: str
    field: str
    paths: tuple[str, ...]
    """Its curves, as ``/truth.rate[0]``."""


def layout(bus: str, topics: Topics, *, video: bool = False) -> bytes:
    """Return the layout as both import it; the view follows the body ``bus``.

    ``topics`` are the fields and their shapes by topic; with ``video`` /video is shown.
    """
    configs: dict[str, object] = {
        "3D!scene": {
            "followTf": bus,
            "followMode": "follow-position",
            "topics": {"/scene": {"visible": True}, "/arrows": {"visible": True}},
        },
        "RosOut!events": {"topicToRender": "/events"},
    }
    plots = []
    for number, plot in enumerate(plots_of(topics)):
        plots.append(f"Plot!{number}")
        configs[plots[-1]] = {
            "foxglovePanelTitle": plot.title,
            "paths": [
                {"value": path, "enabled": True, "timestampMethod": "receiveTime"}
                for path in plot.paths
            ],
        }
    half = (len(plots) + 1) // 2
    tree: object = {
        "first": "3D!scene",
        "second": "RosOut!events",
        "direction": "column",
        "splitPercentage": 80,
    }
    if video:
        configs["Image!video"] = {"imageMode": {"imageTopic": "/video"}}
        tree = {"first": "Image!video", "second": tree, "direction": "column"}
    for column, share in ((plots[:half], 40), (plots[half:], 60)):
        if column:
            tree = {
                "first": tree,
                "second": _stack(column),
                "direction": "row",
                "splitPercentage": share,
            }
    whole = {"configById": configs, "globalVariables": {}, "userNodes": {}, "layout": tree}
    return json.dumps(whole, indent=1).encode()


def plots_of(topics: Topics) -> Iterator[Plot]:
    """Yield the plots of what flew, at most ``MOST``."""
    left = MOST
    on_ground = "altitude" in topics.get("/truth", {})
    for title, topic, field in SIGNALS:
        count = math.prod(topics.get(topic, {}).get(field, (0,)))
        if not count or not left or (field in _ONLY_ON_GROUND and not on_ground):
            continue
        left -= 1
        path = f"{topic}.{field}"
        single = topics[topic][field] in ((), (1,))
        paths = [path] if single else [f"{path}[{i}]" for i in range(min(count, _CURVES))]
        yield Plot(title, topic, field, tuple(paths))


def _stack(panels: list[str]) -> object:
    """Return the panels one below the other, of equal heights."""
    if len(panels) == 1:
        return panels[0]
    return {
        "first": panels[0],
        "second": _stack(panels[1:]),
        "direction": "column",
        "splitPercentage": 100.0 / len(panels),
    }
