"""What this machine can draw with: a display, and the OpenGL library that MUJOCO_GL names.

MuJoCo reads that environment variable when it is imported, and fails with a traceback for any
command where the library is not installed.
"""

import os
import sys
from ctypes.util import find_library

from mjspace.errors import NoRendererError

_ON = ("", "enable", "enabled", "on", "true", "1", "glfw")
_OFF = ("disable", "disabled", "off", "false", "0")
_OF_PLATFORM = {"linux": ("egl", "osmesa", "glx"), "win32": ("wgl",), "darwin": ("cgl",)}
_NEEDS = {  # library, and the package of Debian and Ubuntu that provides it
    "egl": ("EGL", "libegl1 libgl1"),
    "osmesa": ("OSMesa", "libosmesa6"),
}


def chosen() -> str:
    """Return the value of MUJOCO_GL; '' when it is not set."""
    return os.environ.get("MUJOCO_GL", "").lower().strip()


def check() -> None:
    """Check MUJOCO_GL.

    Raises:
        NoRendererError: MuJoCo does not know the value, or the library is not installed. The
            message lists the known values, or what to install.
    """
    value = chosen()
    known = (*_OF_PLATFORM.get(sys.platform, ()), *_ON[1:], *_OFF)
    if value and value not in known:
        raise NoRendererError(
            f"MUJOCO_GL={os.environ['MUJOCO_GL']}: MuJoCo does not know this value; use one of "
            f"{', '.join(known)}, or unset it"
        )
    library, package = _NEEDS.get(value, ("", ""))
    if library and find_library(library) is None:
        raise NoRendererError(
            f"MUJOCO_GL={value}: the library {library} is not installed (Debian and Ubuntu: "
            f"apt-get install {package}); install it, or unset MUJOCO_GL"
        )


def is_off() -> bool:
    """Tell whether MUJOCO_GL switches rendering off."""
    return chosen() in _OFF


def has_display() -> bool:
    """Return whether a window can be opened: on Linux, whether a display is named."""
    named = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return sys.platform != "linux" or bool(named)
