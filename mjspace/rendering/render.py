"""Renders a log as a video or a picture: its model in the logged states."""

from collections.abc import Callable, Iterable, Iterator
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from mjspace.contract import Array
from mjspace.errors import whole_or_none
from mjspace.log.flown_scenario import scenario_of
from mjspace.log.reader import Log
from mjspace.rendering import overlay
from mjspace.rendering.captions import captions, time_text
from mjspace.rendering.decorations import Lines, decorations
from mjspace.rendering.flown_model import flown_model
from mjspace.rendering.offscreen import Canvas
from mjspace.rendering.sampling import nearest_rows
from mjspace.rendering.scene import Decoration, Stage
from mjspace.rendering.video import Frame, Video

_LARGEST = 8192  # pixels: 5 GB and 17 s for a still, drawn in software
_FASTEST = 1000.0  # frames a second
_MOST_FRAMES = 1_000_000


def render(
    log: Log | Path | str,
    output: Path | str,
    *,
    camera: str = "chase",
    size: tuple[int, int] = (960, 540),
    rate: float = 25.0,
    speed: float = 1.0,
    at: float | None = None,
    arrows: bool = True,
    progress: Callable[[int, int], None] = lambda drawn, count: None,
) -> None:
    """Draw a log: a video where ``output`` ends in .mp4, a still where it ends in .png.

    A video has ``rate`` frames per second and shows ``speed`` simulated seconds per second, from
    the first instant of the log to the last (to within a frame). A still shows the time ``at`` [s],
    by default the end. ``size`` is (width, height) in pixels. Without ``arrows`` there are neither
    these nor letters at the axes, trail and landing site. ``progress`` is called after each frame
    of a video with how many are drawn, and of how many.

    Raises:
        ValueError: an unknown file ending or camera, an odd size of a video, a rate or speed that
            is not positive, a time that was not logged, or a file that is not a log of mjspace.
        NoRendererError: this machine cannot render; the message says what to install.
        OSError: a file cannot be read or written.
    """
    log, output = Log.of(log), Path(output)
    if output.suffix not in (".mp4", ".png"):
        raise ValueError(f"output {str(output)!r}: end it in .mp4 for a video, .png for a still")
    if not (min(size) >= 16 and max(size) <= _LARGEST):
        raise ValueError(f"size {size[0]}x{size[1]}: should be from 16x16 to {_LARGEST}x{_LARGEST}")
    if not (1.0 / _FASTEST <= rate <= _FASTEST and 0.0 < speed < np.inf):
        raise ValueError(
            f"rate {rate:g}, speed {speed:g}: a rate should be from {1.0 / _FASTEST:g} to "
            f"{_FASTEST:g}, a speed positive"
        )
    if output.suffix == ".png":
        times: Array = np.array([_still_time(log, at)])
        (frame,) = frames_at(log, times, camera, size, arrows)
        with whole_or_none(output) as file:
            Image.fromarray(frame).save(file, format="png")
        return
    frames = (log.end - log.start) * (rate / speed)
    if not frames < _MOST_FRAMES:
        raise ValueError(
            f"rate {rate:g}, speed {speed:g}: a video of {frames:.3g} frames, should be at most "
            f"{_MOST_FRAMES}"
        )
    period = speed / rate
    count = int((log.end - log.start) / period + 1e-9) + 1
    times = np.linspace(log.start, log.start + period * (count - 1), count)
    with Video(output, size, rate) as video:
        for drawn, frame in enumerate(frames_at(log, times, camera, size, arrows), 1):
            video.write(frame)
            progress(drawn, count)


def _still_time(log: Log, at: float | None) -> float:
    if at is None:
        return log.end
    if not log.start <= at <= log.end:
        raise ValueError(f"at {at:g} s: the log has {log.start:g} s to {log.end:g} s")
    return at


def frames_at(
    log: Log, times: Array, camera: str, size: tuple[int, int], arrows: bool = True
) -> Iterator[Frame]:
    """Yield the picture of a log at each of the ascending ``times`` (n,) [s], as ``render`` does.

    Raises:
        ValueError: an unknown camera, or a time that was not logged.
        NoRendererError: this machine cannot render; the message says what to install.
    """
    scenario = scenario_of(log)
    model = flown_model(log, scenario)
    stage = Stage(model, camera, scenario.environment.orbit)
    law = scenario.law.kind
    around: Iterable[tuple[Decoration | None, Lines]] = repeat((None, []), len(times))
    if arrows:
        around = decorations(log, law, model, times)
    with Canvas(stage.model, size) as canvas:
        for time, physics, desired, pulses, thrust, caption, (decorated, lines) in zip(
            times,
            nearest_rows(log, "/state", "physics", times),
            nearest_rows(log, "/reference", "attitude", times),
            _pulses(log, times),
            shares_of_thrust(log, scenario.plant.engine, times),
            captions(log, law, times),
            around,
            strict=True,
        ):
            stage.set(float(time), physics, desired, pulses, thrust, decorated)
            frame = canvas.draw(stage.scene)
            now = time_text(float(time), log.end - log.start)
            overlay.letters(frame, stage.written())
            overlay.write(frame, (scenario.name, law), (now, caption))
            overlay.legend(frame, lines)
            yield frame


def _pulses(log: Log, times: Array) -> Iterable[Array | None]:
    """Yield what is above zero for each thruster that is on: its on-time, or thrust that goes on.

    None for a vehicle without any.
    """
    fields = {"on_time", "thruster_thrust"} & log.topics.get("/command", {}).keys()
    if not fields:
        return repeat(None, len(times))
    each = (nearest_rows(log, "/command", field, times) for field in sorted(fields))
    return (np.maximum.reduce(rows) for rows in zip(*each, strict=True))


def shares_of_thrust(log: Log, engine: Any, times: Array) -> Iterator[float]:
    """Yield the thrust at each time over the engine's largest: 0 for a vehicle without engine."""
    if engine is None:
        yield from repeat(0.0, len(times))
    else:
        for thrust in nearest_rows(log, "/truth", "thrust", times):
            yield float(thrust[0]) / engine.thrust_max
