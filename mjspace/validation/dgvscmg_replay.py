"""The bus of a double-gimbal CMG by a model of it, while gimbals and wheel move as they were flown.

The momentum of the whole is integrated under the torque from outside; a model, full or simplified,
says what of it is the bus's: how far the thesis' simplification is from the plant that flies.
"""

from collections.abc import Callable

import numpy as np

from mjspace import attitude
from mjspace.contract import Array
from mjspace.validation.dgvscmg_equations import Vehicle, balance, steering

Model = Callable[[Vehicle, Array], tuple[Array, Array]]


def full(vehicle: Vehicle, y: Array) -> tuple[Array, Array]:
    """Return the inertia (3, 3) of the whole, and the momentum (3,) of its joints' rates.

    ``y`` (13,) is a state of ``dgvscmg_equations``, of which the bus's rate is not used; kg m^2 and
    N m s, body axes; (2.47), (2.48).
    """
    mass, _ = balance(vehicle, y)
    return mass[:3, :3], mass[:3, 3:] @ y[10:]


def simplified(vehicle: Vehicle, y: Array) -> tuple[Array, Array]:
    """Return the same of the simplified model: the bus's alone and Jw W s, (2.54)."""
    return vehicle.bus, steering(vehicle, y)[:, 2] * y[12]


def replayed(
    model: Model,
    vehicle: Vehicle,
    bus: Array,
    angle: Array,
    rate: Array,
    outside: Array,
    step: float,
) -> Array:
    """Return attitude and rate (m, 7) of the bus at every second instant.

    ``bus`` (7,) is its attitude and rate [rad/s] at first. ``angle`` [rad] and ``rate`` [rad/s],
    both (n, 3), of outer gimbal, inner gimbal and wheel, and the torque from ``outside`` (n, 3)
    [N m], body axes, are ``step`` [s] apart: RK4 has them in the middle of its double step.
    """

    def turning(q: Array, momentum_w: Array, k: int) -> Array:
        inertia, of_joints = model(vehicle, np.concatenate([q, angle[k], np.zeros(3), rate[k]]))
        momentum = attitude.rotate(attitude.conjugate(q), momentum_w) - of_joints
        return np.asarray(np.linalg.solve(inertia, momentum))

    def slope(y: Array, k: int) -> Array:
        turn = np.concatenate([[0.0], turning(y[:4], y[4:], k)])
        moment = attitude.rotate(y[:4], outside[k])
        return np.concatenate([0.5 * attitude.multiply(y[:4], turn), moment])

    q, both = bus[:4], 2.0 * step
    inertia, of_joints = model(vehicle, np.concatenate([q, angle[0], np.zeros(3), rate[0]]))
    y = np.concatenate([q, attitude.rotate(q, inertia @ bus[4:] + of_joints)])
    rows = [bus]
    for k in range(0, len(angle) - 2, 2):
        one = slope(y, k)
        two = slope(y + 0.5 * both * one, k + 1)
        three = slope(y + 0.5 * both * two, k + 1)
        four = slope(y + both * three, k + 2)
        y = y + both / 6.0 * (one + 2.0 * two + 2.0 * three + four)
        rows.append(np.concatenate([y[:4], turning(y[:4], y[4:], k + 2)]))
    return np.array(rows)
