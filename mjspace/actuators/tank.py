"""Tanks: bodies of the vehicle that lose mass and keep their shape."""

from typing import Any

import numpy as np

from mjspace.contract import Array
from mjspace.vehicle.composition import bus_of

DRY = 1e-6
"""kg left in a tank that is empty: a body without mass would have no inertia."""


def add_sphere(spec: Any, name: str, mass: float, radius: float) -> None:
    """Add a full spherical tank of ``mass`` [kg] and ``radius`` [m] at the body origin."""
    tank = bus_of(spec).add_body(name=name, mass=mass, explicitinertial=True)
    tank.inertia = np.full(3, 0.4 * mass * radius**2)


def masses(
    tank: int, specific_inertia: Array, before: Array, after: Array
) -> dict[str, tuple[int, Array]]:
    """Return, for ``Actuator.masses``, mass and inertia of the body ``tank``.

    ``before`` and ``after`` (N, 1) are the masses [kg] at both ends of the integration step, and
    ``specific_inertia`` (3,) the principal moments [kg m^2] of each kilogram.
    """
    left = np.maximum(0.5 * (before + after), DRY)
    return {"body_mass": (tank, left[:, 0]), "body_inertia": (tank, left * specific_inertia)}
