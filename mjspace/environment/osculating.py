"""The Kepler orbit that a motion has at an instant: from position and velocity to its elements."""

import numpy as np

from mjspace.contract import Array

_CIRCLE = 1e-15
"""Eccentricity below which the place itself counts as periapsis: rounding hides which way it is.
The velocity is then off by that part of itself, a few of its roundings."""


def elements_of(position: Array, velocity: Array, time: Array, gm: float) -> Array:
    """Return the elements that ``kepler.position`` reads, (n, 10), of motions at ``time`` (n,) [s].

    ``position`` [m] and ``velocity`` [m/s] are (n, 3), inertial axes from the centre of a body with
    ``gm`` [m^3/s^2]. No angles are formed, so that orbits without a node (in the x-y plane) or
    without a periapsis (circles) are like any other. Eccentricity vector: Vallado 2013,
    Fundamentals of Astrodynamics and Applications, 4th edition, equation 2-78.

    Raises:
        ValueError: a motion escapes, or falls straight; its eccentricity is not below 1.
    """
    radius, speed2 = _norm(position), np.sum(velocity**2, axis=-1, keepdims=True)
    normal = np.cross(position, velocity)
    momentum = _norm(normal)
    excess = speed2 - 2.0 * gm / radius
    towards = np.cross(velocity, normal) / gm - position / radius
    eccentricity = _norm(towards)
    if (bad := (excess >= 0.0) | (momentum == 0.0)).any():
        first = int(np.argmax(bad))
        e, v, escape = (
            float(x[first, 0]) for x in (eccentricity, np.sqrt(speed2), np.sqrt(2.0 * gm / radius))
        )
        raise ValueError(
            f"the eccentricity is {e:.6g}, should be less than 1: at {radius[first, 0]:.6g} m from "
            f"the centre a velocity of {v:.6g} m/s "
            + (f"escapes, from {escape:.6g} m/s on" if v >= escape else "falls straight to it")
        )
    axis = normal / momentum
    major = -gm / excess
    towards = np.where(eccentricity < _CIRCLE, position, towards)
    towards = towards - axis * np.sum(axis * towards, axis=-1, keepdims=True)
    towards = towards / _norm(towards)
    ahead = np.cross(axis, towards)
    minor = momentum * np.sqrt(major / gm)
    sine = np.sum(position * ahead, axis=-1, keepdims=True) / minor
    cosine = np.sum(position * towards, axis=-1, keepdims=True) / major + eccentricity
    anomaly = np.arctan2(sine, cosine)
    rate = np.sqrt(gm / major) / major
    mean = anomaly - eccentricity * np.sin(anomaly) - rate * time[:, None]
    constant = np.full_like(mean, gm)
    return np.hstack([constant, rate, mean, eccentricity, major * towards, minor * ahead])


def _norm(vectors: Array) -> Array:
    length: Array = np.sqrt(np.sum(vectors**2, axis=-1, keepdims=True))
    return length
