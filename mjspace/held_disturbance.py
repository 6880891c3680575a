"""A disturbance of the user's own, in Python: asked once a step and held over it."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mjspace import attitude
from mjspace.contract import Array, Measurement
from mjspace.errors import FlightError


class HeldDisturbance:
    """A force and torque on the bus, constant over an integration step: first order only."""

    def __init__(self, disturbance: Callable[..., tuple[Any, Any]], applied: Array) -> None:
        """Write to ``applied``, (N, 6): MuJoCo's force and torque on the bus, inertial axes."""
        self._disturbance = disturbance
        self._applied = applied

    def __call__(self, now: float, truth: Measurement) -> Array:
        """Apply it and return force [N], inertial axes, and torque [N m], body axes, (N, 6)."""
        rows = []
        for one in map(Measurement, *truth):
            try:
                force, torque = self._disturbance(now, one)
                rows.append(np.concatenate([np.asarray(force, float), np.asarray(torque, float)]))
            except Exception as error:
                raise FlightError(
                    f"the disturbance raised {type(error).__name__}: {error}"
                ) from error
        wrench = np.array(rows)
        self._applied[:, :3] = wrench[:, :3]
        self._applied[:, 3:] = attitude.rotate(truth.attitude, wrench[:, 3:])
        return wrench
