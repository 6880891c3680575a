"""The caption of a frame: scenario and law, time, and the flight's error."""

from functools import cache
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from mjspace.contract import Array
from mjspace.rendering.video import Frame

WHITE, GREY, SHADE = (255, 255, 255, 255), (200, 208, 220, 255), (0, 0, 0, 96)


def write(frame: Frame, left: tuple[str, str], right: tuple[str, str]) -> None:
    """Write two lines of text into each lower corner of the frame, the upper ones larger.

    Font sizes scale with the frame's height, down to the smallest that is legible.
    """
    height, width = frame.shape[:2]
    margin, large, small = round(0.035 * height), max(11, height // 25), max(9, height // 36)
    upper, lower = height - margin - round(1.45 * small), height - margin
    top = max(upper - large - margin // 2, 0)
    band = Image.fromarray(frame[top:])  # a copy, of the rows that change
    draw = ImageDraw.Draw(band, "RGBA")
    draw.rectangle((0, 0, width, height), fill=SHADE)
    for x, anchor, lines in ((margin, "ls", left), (width - margin, "rs", right)):
        draw.text((x, upper - top), lines[0], WHITE, _font("DejaVuSans-Bold", large), anchor)
        draw.text((x, lower - top), lines[1], GREY, _font("DejaVuSans", small), anchor)
    frame[top:] = np.asarray(band)


def angle_text(angle: float) -> str:
    """Return an angle [rad] in degrees: two decimals, or two digits below 0.01 deg."""
    degrees = float(np.degrees(angle))
    return f"{degrees:.2f} deg" if degrees >= 0.01 else f"{degrees:.2g} deg"


def path_text(position: Array, velocity: Array, error: Array) -> str:
    """Return height [m], speed [m/s] and distance from the desired path [m], of vectors (3,)."""
    speed, off = float(np.linalg.norm(velocity)), float(np.linalg.norm(error))
    return f"height {position[2]:.1f} m, speed {speed:.2f} m/s, {off:.2f} m off its path"


@cache
def _font(name: str, size: int) -> ImageFont.FreeTypeFont:
    # The font comes with matplotlib, so that it exists on every machine.
    return ImageFont.truetype(Path(matplotlib.get_data_path(), "fonts/ttf", f"{name}.ttf"), size)
