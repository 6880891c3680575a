"""A disturbance of the user's own, in Python: called once a step and held over it."""

from typing import Any

import numpy as np

from mjspace import attitude
from mjspace.contract import Array, Measurement, Truth
from mjspace.errors import FlightError
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.state_layout import StateLayout
from mjspace.simulation.user_code import failure, read_only


class HeldDisturbance:
    """A force and torque on the bus, constant over an integration step: first order only."""

    def __init__(self, assembly: Assembly, columns: StateLayout, applied: Array) -> None:
        """Write to ``applied``, (N, 6): MuJoCo's force and torque on the bus, inertial axes."""
        self._disturbance: Any = assembly.disturbance
        self._columns = columns
        self._applied = applied

    def __call__(self, now: float, physics: Array, truth: Measurement) -> Array:
        """Apply it and return force [N], inertial axes, and torque [N m], body axes, (N, 6).

        ``physics`` (N, nstate) are the state rows of which ``truth`` is.

        Raises:
            FlightError: the disturbance raised, or returned anything but a force and a torque.
        """
        known = read_only(self._columns.with_surroundings(physics, truth))
        wrench = np.array([self._of_one(now, one) for one in map(Truth, *known)])
        self._applied[:, :3] = wrench[:, :3]
        self._applied[:, 3:] = attitude.rotate(truth.attitude, wrench[:, 3:])
        return wrench

    def _of_one(self, now: float, truth: Truth) -> Array:
        try:
            returned = self._disturbance(now, truth)
        except Exception as error:
            raise failure("the disturbance", error) from error
        try:
            force, torque = (np.asarray(part, dtype=float) for part in returned)
        except (TypeError, ValueError):
            raise FlightError(f"the disturbance returned {returned!r}: {_RIGHT}") from None
        if force.shape != (3,) or torque.shape != (3,):
            raise FlightError(
                f"the disturbance returned arrays of the shapes {force.shape} and {torque.shape}: "
                f"{_RIGHT}"
            )
        return np.concatenate([force, torque])


_RIGHT = "it must return a force [N] and a torque [N m], three numbers each"
