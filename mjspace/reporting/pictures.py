"""Pictures of a flight inside a page: a still, and its video if that is small."""

import base64
import io
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from PIL import Image

from mjspace.errors import NoRendererError, printable
from mjspace.log.reader import Log

LARGEST_VIDEO = 3_000_000
"""Bytes of a video that a page holds; in base64 they are a third more."""
_STILL, _VIDEO = (960, 540), (640, 360)
_SHOWN = 20.0  # seconds that a video lasts at most


class Picture(NamedTuple):
    """A picture or a video, or why there is none."""

    source: str
    """A ``data:`` address; empty where there is none."""
    note: str


def still(log: Log) -> Picture:
    """Return the vehicle at the end of the log."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "still.png"
        try:
            _rendered(log, path, size=_STILL)
        except (NoRendererError, ValueError) as error:
            return Picture("", f"no picture: {printable(str(error))}")
        small = io.BytesIO()
        with Image.open(path) as image:
            image.save(small, format="webp", quality=82)
    return Picture(_address("image/webp", small.getvalue()), f"at {log.end:g} s")


def video(log: Log, progress: Callable[[int, int], None]) -> Picture:
    """Return the log as a video of at most 20 s, if it is at most ``LARGEST_VIDEO``."""
    speed = max(1.0, (log.end - log.start) / _SHOWN)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "video.mp4"
        try:
            _rendered(log, path, size=_VIDEO, speed=speed, progress=progress)
        except (NoRendererError, ValueError) as error:
            return Picture("", f"no video: {printable(str(error))}")
        content = path.read_bytes()
    if len(content) > LARGEST_VIDEO:
        size = f"{len(content) / 1e6:.1f} MB"
        return Picture("", f"no video: its {size} are too many here; mjspace render writes it")
    pace = "in real time" if speed == 1.0 else f"{speed:.3g} times as fast"
    return Picture(_address("video/mp4", content), pace)


def _rendered(log: Log, path: Path, **options: object) -> None:
    from mjspace.rendering.render import render  # MuJoCo: half a second

    render(log, path, **options)  # type: ignore[arg-type]


def _address(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
