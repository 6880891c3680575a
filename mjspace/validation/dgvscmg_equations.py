"""Equations of motion of a satellite with a double-gimbal variable-speed CMG, full and simplified.

J. Servin Aguilar, Control de orientacion para satelites con compensacion de vibracion, UNAM 2022,
chapter 2: equations (2.47) and (2.48) for the full model, (2.55) to (2.60) for the simplified one,
and the motor torques under (2.62).  Corrected: E1, the gyroscopic term of (2.47) takes the whole
inertia M, not M_b; E2, a wheel's inertia turns with the wheel; E3, the outer gimbal's y axis is
(-sin, cos, 0); E5, the axis in (2.34) is the inner gimbal's; E6, the third input is the wheel's
acceleration.  Here (2.47), (2.48) and the torques are rows of one system, A a + b = f: each body's
M_k alpha_k + w_k x M_k w_k, on the axes that carry it.

The outer gimbal turns about z of the bus, the inner one about y of the outer, the wheel about x of
the inner; all axes meet in the common centre of mass.  A state y (13,) is the attitude quaternion,
the angles of outer gimbal, inner gimbal and wheel [rad], the bus rate in body axes and the three
relative rates [rad/s]: in this order those parts of MuJoCo's qpos and qvel.
"""

from typing import NamedTuple

import numpy as np

from mjspace.contract import Array
from mjspace.validation.kinematics import quaternion_slope

NONE = np.zeros(3)
NONE.setflags(write=False)


class Vehicle(NamedTuple):
    """Inertias about the common centre of mass [kg m^2], each (3, 3) in its body's own axes."""

    bus: Array
    outer: Array
    inner: Array
    wheel: Array


def balance(vehicle: Vehicle, y: Array) -> tuple[Array, Array]:
    """Return A (6, 6) and b (6,) of A a + b = f.

    ``a`` is the bus's angular acceleration and the three relative ones; ``f`` is the torque from
    outside, in body axes, and the three motors' torques.  The upper rows are (2.47), the lower ones
    the torques under (2.62).  With v = y[7:], A v begins with the total momentum in body axes, and
    v A v / 2 is the kinetic energy (2.61).
    """
    mass, bias = np.zeros((6, 6)), np.zeros(6)
    frame = np.eye(3)  # columns: the body's axes, in those of the bus
    carried = np.eye(3, 6)  # from v to the body's rate
    rate, transport = y[7:10], np.zeros(3)  # transport: the body's acceleration where a = 0
    for k, inertia in enumerate(vehicle):
        if k > 0:
            axis = 3 - k
            frame = frame @ turned(axis, y[3 + k])
            carried[:, 2 + k] = frame[:, axis]
            swing = y[9 + k] * frame[:, axis]
            transport = transport + cross_matrix(rate) @ swing
            rate = rate + swing
        inertia_b = frame @ inertia @ frame.T
        mass += carried.T @ inertia_b @ carried
        bias += carried.T @ (inertia_b @ transport + cross_matrix(rate) @ (inertia_b @ rate))
    return mass, bias


def driven(
    vehicle: Vehicle, y: Array, desired: Array = NONE, outside: Array = NONE
) -> tuple[Array, Array]:
    """Return accelerations (6,) and motor torques (3,) [N m] at ``desired`` relative accelerations.

    Those (3,) are of outer gimbal, inner gimbal and wheel [rad/s^2], as are the torques;
    ``outside`` (3,) is the torque from outside in body axes [N m].
    """
    mass, bias = balance(vehicle, y)
    acceleration = np.empty(6)
    acceleration[:3] = np.linalg.solve(mass[:3, :3], outside - bias[:3] - mass[:3, 3:] @ desired)
    acceleration[3:] = desired
    return acceleration, mass[3:] @ acceleration + bias[3:]


def free(vehicle: Vehicle, y: Array, motors: Array = NONE, outside: Array = NONE) -> Array:
    """Return accelerations (6,) under motor torques (3,) and a torque from outside (3,) [N m]."""
    mass, bias = balance(vehicle, y)
    return np.asarray(np.linalg.solve(mass, np.concatenate([outside, motors]) - bias))


def steering(vehicle: Vehicle, y: Array) -> Array:
    """Return chi (3, 3) of the simplified model's torque -chi eta; (2.57) to (2.59)."""
    axes = turned(2, y[4]) @ turned(1, y[5])
    axial = vehicle.wheel[0, 0]
    momentum = axial * y[12]
    chi: Array = axes[:, [1, 2, 0]] * np.array([momentum * np.cos(y[5]), -momentum, axial])
    return chi


def simplified(vehicle: Vehicle, y: Array, eta: Array, outside: Array = NONE) -> Array:
    """Return the bus's acceleration (3,) of the simplified model, (2.60).

    ``eta`` (3,) has the gimbals' rates [rad/s], of which ``derivative`` must find the same in
    ``y``, and the wheel's acceleration [rad/s^2].
    """
    chi = steering(vehicle, y)
    momentum = vehicle.bus @ y[7:10] + chi[:, 2] * y[12]
    torque = cross_matrix(momentum) @ y[7:10] - chi @ eta + outside
    return np.asarray(np.linalg.solve(vehicle.bus, torque))


def derivative(y: Array, acceleration: Array) -> Array:
    """Return y' (13,) for accelerations (6,), of the bus and relative."""
    turn = quaternion_slope(*y[:4].tolist(), *y[7:10].tolist())
    return np.concatenate([turn, y[10:], acceleration])


def turned(axis: int, angle: float) -> Array:
    """Return the matrix (3, 3) of a turn by ``angle`` [rad] about a coordinate axis."""
    j, k = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[j, j] = matrix[k, k] = np.cos(angle)
    matrix[k, j] = np.sin(angle)
    matrix[j, k] = -matrix[k, j]
    return matrix


def cross_matrix(u: Array) -> Array:
    """Return S(u) (3, 3), with S(u) v = u x v."""
    x, y, z = u.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
