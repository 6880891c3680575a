"""dm_control's Physics and Environment, imported so that they work without a window, on MuJoCo 4.

dm_control reads MUJOCO_GL once, when it is imported, and by itself takes a window for granted; and
dm_control 1.0.50 lists arrays, all of flexible bodies, that MuJoCo 4.0 no longer has.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

__all__ = ["Environment", "MjData", "MjModel", "Physics", "Task"]


@contextmanager
def _without_window() -> Iterator[None]:
    """Unless MUJOCO_GL is set, render through EGL or, where that does not load, not at all."""
    if os.environ.get("MUJOCO_GL") or sys.platform != "linux":
        yield
        return
    os.environ["MUJOCO_GL"] = "egl" if _egl_loads() else "off"
    try:
        yield
    finally:
        del os.environ["MUJOCO_GL"]


def _egl_loads() -> bool:
    try:
        import mujoco.egl
    except Exception:  # PyOpenGL fails with every kind of exception where a library is missing
        return False
    return bool(mujoco.egl)


with _without_window():
    from dm_control.mujoco import Physics
    from dm_control.mujoco.wrapper import MjData, MjModel
    from dm_control.mujoco.wrapper.mjbindings import sizes
    from dm_control.rl.control import Environment, Task


def _forget_missing_arrays() -> None:
    """Take out of dm_control's tables the arrays that this MuJoCo does not have."""
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    for name, struct in (("mjmodel", model), ("mjdata", mujoco.MjData(model))):
        table = sizes.array_sizes[name]
        for array in [array for array in table if not hasattr(struct, array)]:
            del table[array]


_forget_missing_arrays()
