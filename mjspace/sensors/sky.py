"""Directions of Sun, Moon and planet from a vehicle, and the sunlight there, for its sensors."""

from typing import Any

import numpy as np

from mjspace import algebra, attitude
from mjspace.contract import Array
from mjspace.sensors.base import Motion


def place(motion: Motion) -> Array:
    """Return the bus from the planet's centre, inertial axes [m], (..., 3)."""
    orbit: Any = motion.surroundings.orbit_position
    found: Array = orbit(motion.time) + motion.position
    return found


def nadir(motion: Motion) -> Array:
    """Return the unit vector to the planet's centre, body axes, (..., 3)."""
    return attitude.rotate(attitude.conjugate(motion.attitude), -attitude.normalize(place(motion)))


def to_sun(motion: Motion) -> Array:
    """Return the unit vector to the Sun, inertial axes, (..., 3), without aberration."""
    sun: Any = motion.surroundings.sun_position
    return attitude.normalize(sun(motion.time) - place(motion))


def sun_direction(motion: Motion) -> Array:
    """Return the unit vector to the Sun, body axes, (..., 3)."""
    return attitude.rotate(attitude.conjugate(motion.attitude), to_sun(motion))


def moon_direction(motion: Motion) -> Array:
    """Return the unit vector to the Moon, body axes, (..., 3)."""
    moon: Any = motion.surroundings.moon_position
    sight = attitude.normalize(moon(motion.time) - place(motion))
    return attitude.rotate(attitude.conjugate(motion.attitude), sight)


def sunlight(motion: Motion) -> Array:
    """Return the part of the Sun's disc that the planet's shadow leaves visible, (..., 1)."""
    around: Any = motion.surroundings
    found: Array = around.sunlight(place(motion), around.sun_position(motion.time))
    return found


def limb(motion: Motion) -> Array:
    """Return the angle between the planet's centre and its limb [rad], (..., 1)."""
    distance = np.sqrt(np.sum(place(motion) ** 2, axis=-1, keepdims=True))
    angle: Array = np.arcsin(np.minimum(motion.surroundings.planet_radius / distance, 1.0))
    return angle


def from_axis(direction: Array, axis: Array) -> Array:
    """Return the angle between a vector (..., 3) and a unit ``axis`` (3,) [rad], (..., 1).

    Exact for small angles too, where a cosine tells nothing.
    """
    normal = algebra.cross(direction, axis)
    sine = np.sqrt(np.sum(normal**2, axis=-1, keepdims=True))
    angle: Array = np.arctan2(sine, np.sum(direction * axis, axis=-1, keepdims=True))
    return angle


def unit(axis: list[float]) -> Array:
    """Return the direction of an ``axis`` of a table, (3,)."""
    return attitude.normalize(np.array(axis))
