"""Encodes a video frame by frame: H.264 in an MP4 file, or as access units."""

from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Self

import av
import numpy as np
from av.video.reformatter import Colorspace
from numpy.typing import NDArray

from mjspace.errors import whole_or_none

Frame = NDArray[np.uint8]
"""An image, shape (height, width, 3), RGB, first row at the top."""

BT709 = 1  # H.264's number for it, ITU-T H.273 table 2
_OPTIONS = {"preset": "veryfast", "crf": "20"}


class Video:
    """An open MP4 file, playable in any player and browser; deleted if it cannot be finished."""

    def __init__(self, path: Path, size: tuple[int, int], rate: float) -> None:
        """Create the file for frames of ``size`` (width, height), ``rate`` of them a second.

        Raises:
            OSError: the file cannot be written.
            ValueError: a width or height that is odd.
        """
        width, height = size
        if width % 2 or height % 2:
            even = f"{width + width % 2}x{height + height % 2}"
            raise ValueError(
                f"size {width}x{height}: a video's width and height must be even, as in {even}"
            )
        self._path = path
        # The index comes before the pictures: playable before it is loaded completely.
        self._file = av.open(str(path), "w", format="mp4", options={"movflags": "+faststart"})
        self._stream = self._file.add_stream(
            "libx264", rate=Fraction(rate).limit_denominator(1001), options=_OPTIONS
        )
        self._stream.width, self._stream.height = width, height
        self._stream.pix_fmt = "yuv420p"
        # Without these, players guess the colours from the picture's size.
        context = self._stream.codec_context
        context.colorspace = context.color_primaries = context.color_trc = BT709
        with whole_or_none(path):
            pass  # it is opened by its name with the first picture, and again for the index

    def write(self, frame: Frame) -> None:
        """Append a frame."""
        self._file.mux(self._stream.encode(_picture(frame)))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        whole = False
        try:
            self._close(finish=error is None)
            whole = error is None
        finally:
            if not whole:
                self._path.unlink(missing_ok=True)

    def _close(self, *, finish: bool) -> None:
        try:
            if finish:
                self._file.mux(self._stream.encode(None))
        finally:
            self._file.close()


def _picture(frame: Frame) -> av.VideoFrame:
    picture = av.VideoFrame.from_ndarray(frame, format="rgb24")
    return picture.reformat(format="yuv420p", dst_colorspace=Colorspace.ITU709)


def access_units(frames: Iterable[Frame], size: tuple[int, int], rate: int) -> Iterator[bytes]:
    """Yield each frame as an H.264 access unit in Annex B, a key frame in each second.

    As ``foxglove.CompressedVideo`` wants it: no frame refers to a later one, and the parameter sets
    stand before each key frame, so that a viewer can begin there.
    """
    context = av.CodecContext.create("libx264", "w")
    context.width, context.height = size
    context.pix_fmt, context.time_base = "yuv420p", Fraction(1, rate)
    context.colorspace = context.color_primaries = context.color_trc = BT709
    context.options = _OPTIONS | {
        "tune": "zerolatency",  # a frame in, its access unit out
        "x264-params": f"bframes=0:keyint={rate}:scenecut=0:repeat-headers=1:annexb=1",
    }
    for number, frame in enumerate(frames):
        picture = _picture(frame)
        picture.pts = number
        yield from map(bytes, context.encode(picture))
    yield from map(bytes, context.encode(None))
