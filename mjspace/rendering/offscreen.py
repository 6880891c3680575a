"""MuJoCo's renderer without a window: a scene in, an image out."""

import os
import sys
from types import TracebackType
from typing import Any, Self

import mujoco
import numpy as np

from mjspace.errors import NoRendererError
from mjspace.rendering import graphics
from mjspace.rendering.video import Frame

_INSTALL = "install Mesa's EGL (Debian and Ubuntu: apt-get install libegl1 libgl1)"


class Canvas:
    """An OpenGL context with an offscreen buffer; a context manager.

    The context is EGL's on Linux, on a graphics card or in software, unless the environment
    variable MUJOCO_GL names another; elsewhere it is MuJoCo's choice.
    """

    def __init__(self, model: Any, size: tuple[int, int]) -> None:
        """Prepare to draw scenes of ``model`` as images of ``size`` (width, height).

        Raises:
            NoRendererError: no OpenGL context can be created; the message says what to install.
        """
        graphics.check()
        if graphics.is_off():
            raise NoRendererError(
                f"MUJOCO_GL={graphics.chosen()} switches rendering off: unset it to render"
            )
        width, height = size
        model.vis.global_.offwidth, model.vis.global_.offheight = size
        try:
            self._context = _context_type()(width, height)
            self._context.make_current()
            self._renderer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        except Exception as error:  # PyOpenGL and drivers fail with every kind of exception
            reason = " ".join(str(error).split())
            raise NoRendererError(f"cannot render without OpenGL: {_INSTALL} ({reason})") from error
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._renderer)
        self._rectangle = mujoco.MjrRect(0, 0, width, height)
        self._pixels = np.empty((height, width, 3), np.uint8)

    def draw(self, scene: Any) -> Frame:
        """Return the image of a ``mujoco.MjvScene``."""
        mujoco.mjr_render(self._rectangle, scene, self._renderer)
        mujoco.mjr_readPixels(self._pixels, None, self._rectangle, self._renderer)
        return self._pixels[::-1].copy()  # OpenGL's first row is the lowest

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._renderer.free()
        self._context.free()


def _context_type() -> Any:
    """Return the class of OpenGL contexts: EGL's on Linux, unless MUJOCO_GL is set."""
    if sys.platform == "linux" and not os.environ.get("MUJOCO_GL"):
        from mujoco.egl import GLContext
    else:
        from mujoco.gl_context import GLContext
    return GLContext
