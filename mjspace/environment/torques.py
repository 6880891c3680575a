"""Torques among the environment's terms, on the bus and on hinges; compiled.

``vehicle`` is ``environment_kernel.Vehicle`` throughout.
"""

import math
from typing import Any

from numba import njit


@njit(cache=True, error_model="numpy")
def torque_at(series: Any, time: float) -> tuple[float, float, float]:
    """Return a bias and a sum of sinusoids [N m] at ``time`` [s].

    ``series``: the bias (3), then for each sinusoid its frequency [rad/s], the factors of its sine
    (3) and of its cosine (3).
    """
    x, y, z = series[0], series[1], series[2]
    for i in range(3, series.size, 7):
        sine, cosine = math.sin(series[i] * time), math.cos(series[i] * time)
        x += series[i + 1] * sine + series[i + 4] * cosine
        y += series[i + 2] * sine + series[i + 5] * cosine
        z += series[i + 3] * sine + series[i + 6] * cosine
    return x, y, z


@njit(cache=True, error_model="numpy")
def body_torque(series: Any, time: float, vehicle: Any) -> None:
    """Add a torque on the bus whose components are in body axes."""
    torque = torque_at(series, time)
    for i in range(3):
        vehicle.qfrc_passive[vehicle.bus_dof + 3 + i] += torque[i]


@njit(cache=True, error_model="numpy")
def inertial_torque(series: Any, time: float, vehicle: Any) -> None:
    """Add a torque on the bus whose components are in inertial axes."""
    torque = torque_at(series, time)
    for dof in range(vehicle.bus_dof + 3, vehicle.bus_dof + 6):
        s = vehicle.cdof[dof]  # a body axis, in world axes
        vehicle.qfrc_passive[dof] += s[0] * torque[0] + s[1] * torque[1] + s[2] * torque[2]


@njit(cache=True, error_model="numpy")
def magnetic(payload: Any, time: float, vehicle: Any) -> None:
    """Add moment x field [N m] on the bus, the moment being constant in body axes.

    ``payload``: a cubic of time that is the field [T] in inertial axes, as one of
    ``geomagnetism.FieldAlongOrbit.pieces``, and the moment (3) [A m^2].
    """
    since = time - payload[0]
    x, y, z = field_of(payload, 0, since), field_of(payload, 1, since), field_of(payload, 2, since)
    dof, moment = vehicle.bus_dof + 3, payload[13:16]
    a, b, c = vehicle.cdof[dof], vehicle.cdof[dof + 1], vehicle.cdof[dof + 2]  # body axes
    bx = a[0] * x + a[1] * y + a[2] * z
    by = b[0] * x + b[1] * y + b[2] * z
    bz = c[0] * x + c[1] * y + c[2] * z
    vehicle.qfrc_passive[dof] += moment[1] * bz - moment[2] * by
    vehicle.qfrc_passive[dof + 1] += moment[2] * bx - moment[0] * bz
    vehicle.qfrc_passive[dof + 2] += moment[0] * by - moment[1] * bx


@njit(cache=True, error_model="numpy")
def field_of(piece: Any, axis: int, since: float) -> float:
    """Return one component of the field's cubic."""
    slope = (piece[1 + axis] * since + piece[4 + axis]) * since + piece[7 + axis]
    return float(slope * since + piece[10 + axis])


@njit(cache=True, error_model="numpy")
def friction(hinges: Any, vehicle: Any) -> None:
    """Add dry friction [N m] to hinges, as ``bearing_friction.pack`` has packed it."""
    for i in range(0, hinges.size, 5):
        dof, torque = int(hinges[i]), hinges[i + 1]
        speed = vehicle.qvel[dof]
        if hinges[i + 2] > 0.0:
            torque += hinges[i + 2] * math.exp(-((speed / hinges[i + 3]) ** 2))
        vehicle.qfrc_passive[dof] -= torque * math.tanh(speed / hinges[i + 4])


@njit(cache=True, error_model="numpy")
def ripple(hinges: Any, vehicle: Any) -> None:
    """Add amplitude cos(cycles angle + phase) [N m] to hinges; their reaction is what carries them.

    Five numbers for each: dof, place in ``qpos``, amplitude, cycles a turn, phase [rad]. J. Servín
    Aguilar, Control de orientacion para satelites con compensacion de vibracion, UNAM 2022, (4.3).
    """
    for i in range(0, hinges.size, 5):
        angle = vehicle.qpos[int(hinges[i + 1])]
        torque = hinges[i + 2] * math.cos(hinges[i + 3] * angle + hinges[i + 4])
        vehicle.qfrc_passive[int(hinges[i])] += torque
