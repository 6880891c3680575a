"""Where the joints of a vehicle stand in MuJoCo's arrays."""

from typing import Any

import numpy as np

_FREE, _HINGE = 0, 3  # mjtJoint.mjJNT_FREE and mjJNT_HINGE, without the time to import mujoco


def bus(model: Any) -> tuple[int, int]:
    """Return the index of the bus's first speed in ``qvel`` and of its position in ``qpos``.

    The bus is the body of the first free joint.

    Raises:
        ValueError: the model has no free joint.
    """
    free = np.flatnonzero(model.jnt_type == _FREE)
    if free.size == 0:
        raise ValueError("the model has no free joint: the environment needs a bus to act on")
    return int(model.jnt_dofadr[free[0]]), int(model.jnt_qposadr[free[0]])


def hinge(model: Any, name: str) -> tuple[int, int]:
    """Return the index of the hinge's speed in ``qvel`` and of its angle in ``qpos``.

    Raises:
        ValueError: the model has no hinge of that name.
    """
    hinges = {model.joint(i).name: i for i in range(model.njnt) if model.jnt_type[i] == _HINGE}
    if name not in hinges:
        have = ", ".join(hinges) or "none"
        raise ValueError(
            f"friction, ripple or vibration: no hinge {name!r} in the model: its hinges: {have}"
        )
    return int(model.jnt_dofadr[hinges[name]]), int(model.jnt_qposadr[hinges[name]])
