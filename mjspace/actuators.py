"""Reaction-wheel motors: the wanted torque on the bus, shared among wheels that have limits."""

from dataclasses import dataclass, field
from math import inf
from typing import Any

import numba
import numpy as np

from mjspace.contract import Array
from mjspace.scenario import Wheels


@dataclass(frozen=True)
class ReactionWheels:
    """Wheels that are all alike, with a pseudo-inverse allocation.

    Friction is not compensated: what the bearings take is the law's to find out.
    """

    axes: Array
    """Unit spin axes in body axes, shape (n, 3)."""
    torque_limit: float = inf
    """Largest motor torque [N m]."""
    speed_limit: float = inf
    """Largest speed relative to the bus [rad/s]."""
    allocation: Array = field(init=False, repr=False)
    """Motor torques for each unit of torque on the bus, shape (n, 3): -pinv(axes^T)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "allocation", -np.linalg.pinv(self.axes.T))

    def motor_torque(self, torque: Array, wheel_speed: Array) -> tuple[Array, Array]:
        """Return (ctrl, saturated), each of shape (..., n).

        ``torque`` (..., 3) is wanted on the bus, body axes [N m]; ``wheel_speed`` (..., n) is
        relative to the bus [rad/s]. ``ctrl`` [N m] is the motors' torque on their rotors, whose
        reaction turns the bus: of all that would give ``torque``, the one of least norm, each
        wheel's then cut to the torque limit. A wheel at its speed limit or beyond gets no torque
        that would raise its speed; as a command is held, it may pass the limit by what one control
        period adds. ``saturated`` is 1.0 for a wheel that does not get the torque allotted to it,
        else 0.0.
        """
        ctrl, saturated = _motor_torque(
            torque, wheel_speed, self.allocation, self.torque_limit, self.speed_limit
        )
        return ctrl, saturated

    def torque_on_bus(self, ctrl: Array) -> Array:
        """Return the motors' reaction on the bus [N m], body axes, shape (..., 3)."""
        torque: Array = _reaction(ctrl, self.axes)
        return torque


def reaction_wheels(table: Wheels) -> ReactionWheels:
    """Return the wheels of a scenario's table; their axes need not be of unit length there."""
    axes = np.array(table.axes, dtype=float)
    return ReactionWheels(
        axes=axes / np.linalg.norm(axes, axis=1, keepdims=True),
        torque_limit=inf if table.torque_limit is None else table.torque_limit,
        speed_limit=inf if table.speed_limit is None else table.speed_limit,
    )


# Products are written out: BLAS may round one vehicle's differently in a batch than alone.
@numba.guvectorize(
    ["void(f8[:], f8[:], f8[:, :], f8, f8, f8[:], f8[:])"],
    "(k),(n),(n,k),(),()->(n),(n)",
    cache=True,
)
def _motor_torque(
    torque: Any,
    speed: Any,
    allocation: Any,
    torque_limit: Any,
    speed_limit: Any,
    ctrl: Any,
    saturated: Any,
) -> None:
    for i in range(speed.size):
        wanted = 0.0
        for k in range(torque.size):
            wanted += allocation[i, k] * torque[k]
        given = wanted
        if abs(given) > torque_limit:
            given = np.copysign(torque_limit, wanted)
        if abs(speed[i]) >= speed_limit and given * speed[i] > 0.0:
            given = 0.0
        ctrl[i] = given
        saturated[i] = 1.0 if given != wanted else 0.0


@numba.guvectorize(["void(f8[:], f8[:, :], f8[:])"], "(n),(n,k)->(k)", cache=True)
def _reaction(ctrl: Any, axes: Any, torque: Any) -> None:
    for k in range(torque.size):
        torque[k] = 0.0
        for i in range(ctrl.size):
            torque[k] -= axes[i, k] * ctrl[i]
