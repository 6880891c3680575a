"""Where a hinge of the vehicle stands in MuJoCo's arrays."""

from typing import Any

_HINGE = 3  # mjtJoint.mjJNT_HINGE


def hinge(model: Any, name: str) -> tuple[int, int]:
    """Return the index of the hinge's speed in ``qvel`` and of its angle in ``qpos``.

    Raises:
        ValueError: the model has no hinge of that name.
    """
    hinges = {model.joint(i).name: i for i in range(model.njnt) if model.jnt_type[i] == _HINGE}
    if name not in hinges:
        have = ", ".join(hinges) or "none"
        raise ValueError(f"friction or ripple: no hinge {name!r} in the model: its hinges: {have}")
    return int(model.jnt_dofadr[hinges[name]]), int(model.jnt_qposadr[hinges[name]])
