"""A replay as one HTML file, which opens from disk: the picture, its player and the plots."""

from collections.abc import Callable
from importlib import metadata
from itertools import pairwise
from pathlib import Path

import numpy as np

from mjspace.contract import Array
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.frames import bus_of
from mjspace.log.reader import Log
from mjspace.reporting import page
from mjspace.reporting.flight_charts import flight_charts
from mjspace.view.moments import Moments
from mjspace.view.scene import Scene
from mjspace.view.server import LOOPBACK, serving
from mjspace.view.shapes import bodies

_RATE = 25.0  # frames a second
_LONGEST = 60.0  # s of playing: a longer flight is shown faster


def export(
    log: Log, output: Path, *, progress: Callable[[float], None] = lambda time: None
) -> None:
    """Write the replay of a log to ``output``. ``progress`` is called with each frame's time [s].

    Raises:
        ValueError: ``output`` does not end in .html, or the log is damaged.
        OSError: a file cannot be read or written.
    """
    page.require_html(output)
    scenario = scenario_of(log)
    duration = log.end - log.start
    speed = max(1.0, duration / _LONGEST)
    count = max(2, round(duration / speed * _RATE) + 1)
    faster = f", shown {speed:.3g} times as fast" if speed > 1.0 else ""
    page.write(
        output,
        "replay.html.j2",
        flight_charts([log], [scenario.name], [scenario.checks]),
        viewer=_recorded(log, np.linspace(log.start, log.end, count), speed, progress),
        title=scenario.name,
        description=scenario.description,
        flown=f"{duration:g} s flown{faster}.",
        start=log.start,
        speed=speed,
        viewer_license=_license(),
    )


def _recorded(log: Log, times: Array, speed: float, progress: Callable[[float], None]) -> str:
    """Return viser's own page with the recording of the moments at ``times`` (n,) [s] in it."""
    moments = Moments(log)
    # Nobody connects: viser records what a server would send.
    with serving(LOOPBACK, 0, "mjspace") as (server, _):
        scene = Scene(server, bodies(moments.frames.scene()), bus_of(log))
        scene.longest, scene.path = moments.survey(scene.size)
        scene.show(moments.at(float(times[0])), log.end)
        recording = server.get_scene_serializer()
        for before, time in pairwise(times):
            recording.insert_sleep(float(time - before) / speed)
            scene.show(moments.at(float(time)), log.end)
            progress(float(time))
        page_of_viser: str = recording.as_html(dark_mode=True)
    return page_of_viser


def _license() -> str:
    return metadata.distribution("viser").read_text("licenses/LICENSE") or "MIT License"
