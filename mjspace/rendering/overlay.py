"""What is written on a frame: its caption below, the legend of its arrows above."""

from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from mjspace.rendering.video import Frame

Pixels = NDArray[np.uint32]
DARK = (0, 0, 0)
WHITE, GREY, SHADE = (255, 255, 255, 255), (200, 208, 220, 255), (0, 0, 0, 96)


def write(frame: Frame, left: tuple[str, str], right: tuple[str, str]) -> None:
    """Write two lines of text into each lower corner of the frame, the upper ones larger.

    Font sizes scale with the frame's height, down to the smallest that is legible. The lower left
    line is left out where there is no room for it.
    """
    height, width = frame.shape[:2]
    margin, large, small = round(0.035 * height), max(11, height // 25), max(9, height // 36)
    upper, lower = height - margin - round(1.45 * small), height - margin
    top = max(upper - large - margin // 2, 0)
    band = Image.fromarray(frame[top:])  # a copy, of the rows that change
    draw = ImageDraw.Draw(band, "RGBA")
    draw.rectangle((0, 0, width, height), fill=SHADE)
    plain = _font("DejaVuSans", small)
    if plain.getlength(left[1]) + plain.getlength(right[1]) > width - 3 * margin:
        left = left[0], ""
    for x, anchor, lines in ((margin, "ls", left), (width - margin, "rs", right)):
        draw.text((x, upper - top), lines[0], WHITE, _font("DejaVuSans-Bold", large), anchor)
        draw.text((x, lower - top), lines[1], GREY, plain, anchor)
    frame[top:] = np.asarray(band)


def legend(frame: Frame, lines: Sequence[tuple[Sequence[float], str, str]]) -> None:
    """Write lines into the upper left corner.

    Each is the color of a letter (red, green and blue from 0 to 1), the letter, and a text.
    """
    height, width = frame.shape[:2]
    margin, size = round(0.035 * height), max(9, height // 36)
    step = round(1.5 * size)
    bottom, right = margin + step * len(lines), min(width, margin + 26 * size)
    part = Image.fromarray(frame[:bottom, :right])  # a copy, of what changes
    draw = ImageDraw.Draw(part)
    for number, (color, letter, text) in enumerate(lines):
        y = margin + step * number
        bold, plain = _font("DejaVuSans-Bold", size), _font("DejaVuSans", size)
        after = margin + round(1.4 * size)
        # A shadow, which is drawn ten times as fast as an edge around each letter.
        for shift, first, second in ((1, DARK, DARK), (0, _shade(color), GREY[:3])):
            draw.text((margin + shift, y + shift), letter, first, bold)
            draw.text((after + shift, y + shift), text, second, plain)
    frame[:bottom, :right] = np.asarray(part)


def letters(frame: Frame, written: Iterable[tuple[float, float, str, Sequence[float]]]) -> None:
    """Write texts around places: in heights of the frame, from its middle to the right, from above.

    Each has a color, red, green and blue from 0 to 1. Where two would cover each other, the later
    one stands to the right. What is not wholly in the frame is left out.
    """
    height, width = frame.shape[:2]
    size, taken = max(9, height // 34), list[tuple[int, int]]()
    for across, down, text, color in written:
        x, y = round(0.5 * width + across * height), round(down * height)
        while any(abs(x - u) < size and abs(y - v) < size for u, v in taken):
            x += size
        taken.append((x, y))
        ink, cover = _tile(text, _shade(color), size)
        tall, wide = cover.shape[:2]
        top, left = y - tall // 2, x - wide // 2
        if top >= 0 and left >= 0 and top + tall <= height and left + wide <= width:
            part = frame[top : top + tall, left : left + wide]
            part[:] = (ink + part * (255 - cover)) // 255


@cache
def _tile(text: str, color: tuple[int, ...], size: int) -> tuple[Pixels, Pixels]:
    """Return a text with a dark edge: its color times its opacity (h, w, 3), and that (h, w, 1).

    Opacity is from 0 to 255. Texts are few and edges slow to draw, so that they are kept.
    """
    tile = Image.new("RGBA", (4 * size, 2 * size))
    ImageDraw.Draw(tile).text(
        (2 * size, size),
        text,
        color,
        _font("DejaVuSans-Bold", size),
        "mm",
        stroke_width=max(1, size // 10),
        stroke_fill=DARK,
    )
    pixels = np.asarray(tile).astype(np.uint32)
    return pixels[..., :3] * pixels[..., 3:], pixels[..., 3:]


def _shade(color: Sequence[float]) -> tuple[int, ...]:
    return tuple(round(255 * share) for share in color)


@cache
def _font(name: str, size: int) -> ImageFont.FreeTypeFont:
    # The font comes with matplotlib, so that it exists on every machine.
    return ImageFont.truetype(Path(matplotlib.get_data_path(), "fonts/ttf", f"{name}.ttf"), size)
