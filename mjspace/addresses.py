"""Where a vehicle's joints, motors and sensors are in MuJoCo's arrays."""

import re
from collections.abc import Collection, Iterable
from typing import Any

import numpy as np


def of(model: Any, wheels: int, driven: Collection[str]) -> dict[str, Any]:
    """Return ``plant.Vehicle``'s fields for that many reaction wheels, and ``driven`` hinges.

    Raises:
        ValueError: no motor turns one of the hinges, or a motor is left without its drive.
        KeyError: a wheel or a sensor is not in the model.
    """
    reaction_wheels = [f"wheel_{index}" for index in range(wheels)]
    drives = _by_motor(model, driven)
    gimbals = [name for name in drives if not name.endswith("wheel")]
    spun = [*reaction_wheels, *(name for name in drives if name not in gimbals)]
    return {
        "wheel_dof": _where(model.joint(name).dofadr for name in spun),
        "gimbal_dof": _where(model.joint(name).dofadr for name in gimbals),
        "gimbal_qpos": _where(model.joint(name).qposadr for name in gimbals),
        "drive_dof": _where(model.joint(name).dofadr for name in drives),
        "motors": (*reaction_wheels, *drives),
        **{name: _sensor(model, name) for name in ("momentum", "kinetic", "environment")},
    }


def _by_motor(model: Any, driven: Collection[str]) -> list[str]:
    """Return the ``driven`` hinges in the order of their motors in ``ctrl``."""
    turned = [model.joint(model.actuator_trnid[i, 0]).name for i in range(model.nu)]
    parts = [name for name in turned if not re.fullmatch(r"wheel_\d+", name)]
    for name in driven:
        if name not in parts:
            raise ValueError(f"plant.drives.{name}: no motor turns it: have {', '.join(parts)}")
    if left := set(parts).difference(driven) if driven else ():
        raise ValueError(f"plant.drives: {', '.join(sorted(left))} has a motor and no drive")
    return parts if driven else []


def _where(addresses: Iterable[Any]) -> Any:
    return frozen(np.array([address[0] for address in addresses], dtype=int))


def _sensor(model: Any, name: str) -> slice:
    sensor = model.sensor(name)
    return slice(int(sensor.adr[0]), int(sensor.adr[0] + sensor.dim[0]))


def frozen(array: Any) -> Any:
    """Return the array, which nobody can write to any more."""
    array.setflags(write=False)
    return array
