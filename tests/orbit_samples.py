"""Orbits, their ephemerides, and how well a reference's parts agree with each other."""

from typing import Any

import numpy as np

from mjspace import attitude as att
from mjspace.contract import Array
from mjspace.environment.ephemeris import KnownEphemeris
from mjspace.scenario.environment import Environment

EPOCH = "2026-05-10T12:00:00"
ORBITS: dict[str, dict[str, Any]] = {
    "circle": {"semi_major_axis": 7e6},
    "inclined": {"semi_major_axis": 7.2e6, "inclination": 1.2, "ascending_node": 2.0},
    "eccentric": {
        **{"semi_major_axis": 1.2e7, "eccentricity": 0.4, "inclination": 0.8},
        **{"periapsis": 1.0, "true_anomaly": 4.0},
    },
    "drifting": {
        **{"semi_major_axis": 6.9e6, "eccentricity": 0.02, "inclination": 1.7},
        **{"ascending_node": 0.5, "j2": True},
    },
}


def ephemeris(orbit: str, **changes: Any) -> KnownEphemeris:
    """Return the ephemeris of one of ``ORBITS``, with ``changes``."""
    return KnownEphemeris(Environment(orbit=ORBITS[orbit] | changes, epoch=EPOCH))


def agreement(source: Any, times: Array, step: float) -> tuple[float, float]:
    """Return the largest errors of the rate [rad/s] and the acceleration [rad/s^2].

    Against central differences of the eighth order, of the attitude and of the rate.
    """
    factors = np.array([4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0])
    now = source.at(times)
    slope = np.zeros_like(now.attitude)
    bend = np.zeros_like(now.rate)
    for k, factor in enumerate(factors, 1):
        after, before = source.at(times + k * step), source.at(times - k * step)
        slope += factor * (after.attitude - before.attitude) / step
        bend += factor * (after.rate - before.rate) / step
    spin = 2.0 * att.multiply(att.conjugate(now.attitude), slope)
    return (
        float(np.abs(spin - att.pure(now.rate)).max()),
        float(np.abs(bend - now.acceleration).max()),
    )
