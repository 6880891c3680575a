"""Altimeters: the height above the planet's sphere, or above a plane where there is none."""

from typing import Any

import numpy as np
import pytest

from mjspace.environment.gravity import CentralGravity
from mjspace.sensors.altimeter import Altimeter
from mjspace.sensors.base import Motion, Surroundings

RADIUS = 1738e3
MOON = CentralGravity(radius=RADIUS)


def height(position: Any, surroundings: Surroundings) -> Any:
    none: Any = None
    motion = Motion(none, none, none, none, np.asarray(position), none, surroundings)
    return Altimeter().true_value(motion)


@pytest.mark.parametrize("angle", [0.0, 1e-6, 0.26, 3.0])
@pytest.mark.parametrize("above", [1.8, 15e3])
def test_it_is_the_distance_from_the_centre_less_the_radius(angle: float, above: float) -> None:
    away = (RADIUS + above) * np.array([np.sin(angle), 0.0, np.cos(angle)])
    found = height(away - [0.0, 0.0, RADIUS], Surroundings(height=MOON.height))
    # rounding of a position of 2e6 m from the centre
    assert found == pytest.approx(above, abs=1e-9)


def test_without_a_planet_it_is_the_third_coordinate() -> None:
    position = np.array([[3e3, 4e3, 50.0], [0.0, 0.0, -1.0]])
    assert np.array_equal(height(position, Surroundings()), position[:, 2:])
    # 25e6 / 2 / 1738e3 m of fall of the sphere
    fall = height(position[0], Surroundings(height=MOON.height)) - 50.0
    assert fall == pytest.approx(25e6 / 2.0 / RADIUS, rel=1e-4)
