"""Mass properties: a rotor's, and those of the bus from the vehicle's less its wheels'."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from mjspace.contract import Array
from mjspace.scenario.hinges import Bearing
from mjspace.scenario.plant import PlantTable, Wheels


class Inertial(NamedTuple):
    """Mass properties of a body, in MuJoCo's fields."""

    mass: float
    """Mass [kg]."""
    ipos: Array
    """Centre of mass in the body's axes [m], shape (3,)."""
    inertia: Array
    """Principal moments [kg m^2], shape (3,)."""
    iquat: Array
    """Principal axes, as a quaternion to the body's axes, scalar first, shape (4,)."""


def unit_axes(wheels: Wheels) -> Array:
    """Return the spin axes as unit vectors, body axes, shape (n, 3)."""
    axes = np.reshape(np.array(wheels.axes, dtype=float), (-1, 3))
    result: Array = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    return result


def rotor(wheels: Wheels) -> Inertial:
    """Return the mass properties of each rotor, its spin axis along z.

    Raises:
        ValueError: the transverse inertia or the product of inertia is impossible for a rotor.
    """
    axial, transverse = wheels.inertia, transverse_inertia(wheels)
    if 2.0 * transverse < axial:
        raise ValueError(
            f"plant.wheels.transverse_inertia: {transverse:g} kg m^2 is less than half the axial "
            f"{axial:g} kg m^2, which is impossible for a rotor"
        )
    balanced = Inertial(
        wheels.mass,
        np.zeros(3),
        np.array([transverse, transverse, axial]),
        np.array([1.0, 0.0, 0.0, 0.0]),
    )
    return off_balance(balanced, np.array([0.0, 0.0, 1.0]), wheels, "plant.wheels")


def off_balance(body: Inertial, axis: Array, bearing: Bearing, key: str) -> Inertial:
    """Return the mass properties of a body that turns about ``axis`` (3,), a unit vector, with the
    imbalance of its ``bearing``.

    Static imbalance is an offset of the mass across the axis, dynamic imbalance a product of
    inertia between the axis and that offset's direction. The axial inertia is kept, and so is the
    transverse one, except for a rotor so flat that its mass has to extend along the axis.

    Raises:
        ValueError: the product of inertia would change the transverse inertia by more than a
            hundredth; ``key`` is the bearing's in the scenario.
    """
    largest = int(np.argmax(np.abs(axis)))
    across = np.eye(3)[(largest + 1) % 3]
    across = across - (across @ axis) * axis
    across /= np.linalg.norm(across)
    body = body._replace(ipos=body.ipos + bearing.static_imbalance / body.mass * across)
    if not bearing.dynamic_imbalance:
        return body
    frame = np.stack([axis, across, np.cross(axis, across)])
    inertia = frame @ tensor(body.inertia, body.iquat) @ frame.T
    # Second moments of the mass: those of a real body are positive semidefinite.
    spread = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    spread[0, 1] = spread[1, 0] = spread[0, 1] - bearing.dynamic_imbalance
    need = spread[0, 1:] @ np.linalg.solve(spread[1:, 1:], spread[0, 1:])
    allowed = spread[0, 0] + 0.01 * inertia[1, 1]
    if need > allowed:
        most = bearing.dynamic_imbalance * np.sqrt(allowed / need)
        raise ValueError(
            f"{key}.dynamic_imbalance: {bearing.dynamic_imbalance:g} kg m^2 is above the "
            f"largest possible of the rotating body, {most:.3g} kg m^2"
        )
    spread[0, 0] = max(spread[0, 0], need + 1e-9 * inertia[1, 1])  # rounding must not undo it
    askew = np.trace(spread) * np.eye(3) - spread
    moments, iquat = principal(frame.T @ askew @ frame)
    return body._replace(inertia=moments, iquat=iquat)


def bus(table: PlantTable, own: Array) -> tuple[Inertial, Array]:
    """Return the mass properties of the bus, and the gyrostat inertia H of the whole vehicle.

    The bus's mass is shifted so that the vehicle's centre of mass is the body origin. H is the
    whole vehicle about it less the wheels' axial inertia, body axes, shape (3, 3): H = I_bus
    + sum Jt (1 - a a^T) + the parallel-axis terms of bus and wheels. ``own`` is the bus inertia
    [kg m^2] where the table sets none. Wheel imbalance, which rotates, is not balanced.

    Raises:
        ValueError: the wheels have more inertia than ``gyrostat_inertia``.
    """
    wheels = table.wheels
    axes = unit_axes(wheels)
    centres = np.zeros_like(axes) if wheels.positions is None else np.array(wheels.positions)
    centre = -wheels.mass * centres.sum(axis=0) / table.mass
    offsets = table.mass * _point(centre) + wheels.mass * np.sum(
        [_point(c) for c in centres], axis=0
    )
    across = transverse_inertia(wheels) * (len(axes) * np.eye(3) - axes.T @ axes)
    if table.gyrostat_inertia is None:
        inertia = own if table.bus_inertia is None else np.array(table.bus_inertia)
        gyrostat = inertia + across + offsets
    else:
        gyrostat = np.array(table.gyrostat_inertia)
        inertia = gyrostat - across - offsets
        if np.linalg.eigvalsh(inertia)[0] <= 0.0:
            raise ValueError(_too_much(inertia, gyrostat - offsets, across, wheels))
    return Inertial(table.mass, centre, *principal(inertia)), gyrostat


def principal(inertia: Array) -> tuple[Array, Array]:
    """Return the principal moments (3,), ascending, and axes (4,) of an inertia matrix (3, 3)."""
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])  # right-handed
    return moments, Rotation.from_matrix(axes).as_quat(scalar_first=True)


def own_inertia(body: Any) -> Array:
    """Return the inertia matrix (3, 3) [kg m^2] that a body of an ``MjSpec`` states."""
    if np.isnan(body.fullinertia[0]):
        return tensor(body.inertia, body.iquat)
    xx, yy, zz, xy, xz, yz = body.fullinertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def remainder(whole: float, inertia: Array, others: Sequence[Inertial]) -> Inertial:
    """Return the bus: a vehicle of mass ``whole`` [kg] less the bodies ``others``.

    ``inertia`` (3, 3) [kg m^2] is the vehicle's about the body origin, its centre of mass.

    Raises:
        ValueError: the others have more mass or inertia than the vehicle.
    """
    left = whole - sum(other.mass for other in others)
    if left <= 0.0:
        raise ValueError(
            f"plant.vehicle_mass: {whole:g} kg is less than the parts' {whole - left:.6g} kg"
        )
    moment = np.sum([other.mass * other.ipos for other in others], axis=0)
    centre = -moment / left
    of_others = [tensor(o.inertia, o.iquat) + o.mass * _point(o.ipos) for o in others]
    own = inertia - left * _point(centre) - np.sum(of_others, axis=0)
    if np.linalg.eigvalsh(own)[0] <= 0.0:
        eigenvalues = np.array2string(np.linalg.eigvalsh(own), precision=4)
        raise ValueError(
            f"plant.vehicle_inertia leaves a bus with the eigenvalues {eigenvalues} kg m^2, which "
            "should be positive: use more inertia, or less on the parts"
        )
    return Inertial(left, centre, *principal(own))


def tensor(inertia: Array, iquat: Array) -> Array:
    """Return the inertia matrix [kg m^2] of principal moments (3,) and axes (4,), shape (3, 3)."""
    axes = Rotation.from_quat(iquat, scalar_first=True).as_matrix()
    result: Array = axes @ np.diag(inertia) @ axes.T
    return result


def transverse_inertia(wheels: Wheels) -> float:
    """Return a rotor's inertia [kg m^2] about any axis through its centre across the spin axis."""
    return wheels.inertia / 2.0 if wheels.transverse_inertia is None else wheels.transverse_inertia


def _point(r: Array) -> Array:
    """Return the inertia matrix (3, 3) of a unit mass at ``r`` (3,) [m] about the origin."""
    result: Array = np.dot(r, r) * np.eye(3) - np.outer(r, r)
    return result


def _too_much(inertia: Array, room: Array, across: Array, wheels: Wheels) -> str:
    """Return the message with the bus inertia that remains, and the largest wheels that fit."""
    if np.linalg.eigvalsh(room)[0] <= 0.0:
        cure = "lighter wheels, or wheels nearer to the centre of mass"
    else:
        fits = transverse_inertia(wheels) / eigh(across, room, eigvals_only=True)[-1]
        cure = (
            f"a wheel inertia below {2.0 * fits:.4g} kg m^2"
            if wheels.transverse_inertia is None
            else f"a transverse wheel inertia below {fits:.4g} kg m^2"
        )
    left = np.array2string(np.linalg.eigvalsh(inertia), precision=4)
    return (
        f"plant.gyrostat_inertia leaves a bus with the eigenvalues {left} kg m^2, which should be "
        f"positive: use {cure}"
    )
