"""Mass properties: a rotor's, and those of the bus from the vehicle's less its wheels'."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from mjspace.contract import Array
from mjspace.scenario.hinges import Bearing
from mjspace.scenario.plant import PlantTable

# SciPy is imported when a vehicle is built: it takes 0.3 s, and a scenario's tables need no more
# of this file than its named tuples.


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


class Rotors(NamedTuple):
    """Balanced rotors, whose axial inertia the papers' H leaves out."""

    axes: Array = np.zeros((0, 3))
    """Unit spin axes, body axes, shape (n, 3)."""
    centres: Array = np.zeros((0, 3))
    """Of mass, body axes [m], shape (n, 3)."""
    mass: Array = np.zeros(0)
    """[kg], shape (n,)."""
    inertia: Array = np.zeros(0)
    """Axial [kg m^2], shape (n,)."""
    transverse_inertia: Array = np.zeros(0)
    """About any axis through its centre across the spin axis [kg m^2], shape (n,)."""
    speed_limit: Array = np.zeros(0)
    """Largest speed relative to the bus [rad/s], shape (n,); inf without a limit."""


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


def bus(table: PlantTable, wheels: Rotors, own: Array) -> tuple[Inertial, Array]:
    """Return the bus that balances the wheels, and the gyrostat inertia H of the whole.

    The bus's mass is shifted so that the vehicle's centre of mass is the body origin. H is the
    whole vehicle about it less the wheels' axial inertia, body axes, shape (3, 3): H = I_bus
    + sum Jt (1 - a a^T) + the parallel-axis terms of bus and wheels. ``own`` is the bus inertia
    [kg m^2] of a table without one. Wheel imbalance, which turns, is left out of the balance.

    Raises:
        ValueError: the wheels have more inertia than ``gyrostat_inertia``.
    """
    axes, centres, mass = wheels.axes, wheels.centres, table.mass
    assert mass is not None  # as in every table but that of a user's own model
    # By one wheel's times ratios, which of wheels that are alike are exactly 1.
    heavy, masses = _ratios(wheels.mass)
    centre = -heavy * (masses[:, None] * centres).sum(axis=0) / mass
    of_wheels = [ratio * _point(c) for ratio, c in zip(masses, centres, strict=True)]
    offsets = mass * _point(centre) + heavy * np.sum(of_wheels, axis=0)
    transverse, ratios = _ratios(wheels.transverse_inertia)
    across = transverse * (ratios.sum() * np.eye(3) - axes.T @ (ratios[:, None] * axes))
    if table.gyrostat_inertia is None:
        inertia = own if table.bus_inertia is None else np.array(table.bus_inertia)
        gyrostat = inertia + across + offsets
    else:
        gyrostat = np.array(table.gyrostat_inertia)
        inertia = gyrostat - across - offsets
        if np.linalg.eigvalsh(inertia)[0] <= 0.0:
            raise ValueError(_too_much(inertia, gyrostat - offsets, across, wheels))
    return Inertial(mass, centre, *principal(inertia)), gyrostat


def principal(inertia: Array) -> tuple[Array, Array]:
    """Return the principal moments (3,), ascending, and axes (4,) of an inertia matrix (3, 3)."""
    from scipy.spatial.transform import Rotation

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
    centre = -sum((other.mass * other.ipos for other in others), np.zeros(3)) / left
    of_others = (tensor(o.inertia, o.iquat) + o.mass * _point(o.ipos) for o in others)
    own = inertia - left * _point(centre) - sum(of_others, np.zeros((3, 3)))
    if np.linalg.eigvalsh(own)[0] <= 0.0:
        eigenvalues = np.array2string(np.linalg.eigvalsh(own), precision=4)
        raise ValueError(
            f"plant.vehicle_inertia leaves a bus with the eigenvalues {eigenvalues} kg m^2: give "
            "it more inertia, or the parts less"
        )
    return Inertial(left, centre, *principal(own))


def together(bodies: Iterable[Inertial]) -> tuple[float, Array, Array]:
    """Return mass [kg], centre of mass (3,) [m] and inertia matrix (3, 3) [kg m^2] of all bodies.

    The matrix is about their common centre. All are in the same axes, and so is the result.
    """
    bodies = list(bodies)
    mass = sum(body.mass for body in bodies)
    centre = sum((body.mass * body.ipos for body in bodies), np.zeros(3)) / mass
    parts = (tensor(b.inertia, b.iquat) + b.mass * _point(b.ipos - centre) for b in bodies)
    return mass, centre, sum(parts, np.zeros((3, 3)))


def tensor(inertia: Array, iquat: Array) -> Array:
    """Return the inertia matrix [kg m^2] of principal moments (3,) and axes (4,), shape (3, 3)."""
    from scipy.spatial.transform import Rotation

    axes = Rotation.from_quat(iquat, scalar_first=True).as_matrix()
    result: Array = axes @ np.diag(inertia) @ axes.T
    return result


def _point(r: Array) -> Array:
    """Return the inertia matrix (3, 3) of a unit mass at ``r`` (3,) [m] about the origin."""
    result: Array = np.dot(r, r) * np.eye(3) - np.outer(r, r)
    return result


def _ratios(values: Array) -> tuple[float, Array]:
    """Return the first of the values, 1 if there are none, and all over it."""
    first = float(values[0]) if len(values) else 1.0
    return first, values / first


def _too_much(inertia: Array, room: Array, across: Array, wheels: Rotors) -> str:
    """Return what is left of ``room``, and the largest wheels that fit into it."""
    if np.linalg.eigvalsh(room)[0] <= 0.0:
        cure = "use lighter wheels or place them nearer to the centre of mass"
    else:
        from scipy.linalg import eigh

        share = 1.0 / eigh(across, room, eigvals_only=True)[-1]
        fits = share * wheels.transverse_inertia.max()
        if np.ptp(wheels.transverse_inertia):
            cure = f"use wheels with less than {share:.4g} times their transverse inertia"
        elif np.array_equal(wheels.transverse_inertia, 0.5 * wheels.inertia):
            cure = f"use a wheel inertia below {2.0 * fits:.4g} kg m^2"
        else:
            cure = f"use a transverse wheel inertia below {fits:.4g} kg m^2"
    left = np.array2string(np.linalg.eigvalsh(inertia), precision=4)
    return f"plant.gyrostat_inertia leaves a bus with the eigenvalues {left} kg m^2: {cure}"
