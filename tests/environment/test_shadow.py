"""The Earth's shadow: where umbra, penumbra and the cylinder begin on a circle, and its depth."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import dblquad
from scipy.optimize import brentq

from mjspace.environment.constants import ASTRONOMICAL_UNIT, RADIUS, SUN_RADIUS
from mjspace.environment.shadow import visible

EARTH = RADIUS["earth"]


def seen(angle: float, radius: float, disc: float = SUN_RADIUS, beta: float = 0.0) -> float:
    """Return what is seen of a Sun along x, ``angle`` [rad] from the point of a circle behind.

    The circle's plane is ``beta`` [rad] off the Sun.
    """
    x, y, z = -np.cos(angle) * np.cos(beta), np.sin(angle), np.cos(angle) * np.sin(beta)
    x, y, z = radius * x, radius * y, radius * z
    return visible(x, y, z, ASTRONOMICAL_UNIT - x, -y, -z, EARTH, disc)


@pytest.mark.parametrize("radius", [6.6e6, 6.878e6, 26.56e6, 42.164e6])
def test_cones_begin_at_their_tangents(radius: float) -> None:
    # A tangent to both spheres is at the angle f from the axis, and passes the Earth at its radius.
    penumbra = math.asin(EARTH / radius) + math.asin((SUN_RADIUS + EARTH) / ASTRONOMICAL_UNIT)
    umbra = math.asin(EARTH / radius) - math.asin((SUN_RADIUS - EARTH) / ASTRONOMICAL_UNIT)
    for half, level in ((penumbra, 1.0 - 1e-9), (umbra, 1e-9)):
        found = brentq(lambda angle, of=level: seen(angle, radius) - of, 0.0, half + 0.1)
        # the level is reached 1e-8 rad inside: a part x of the disc has a height as x^(2/3)
        assert found == pytest.approx(half, abs=3e-8)
    assert seen(umbra - 1e-6, radius) == 0.0
    assert seen(penumbra + 1e-6, radius) == 1.0
    assert seen(math.pi, radius) == 1.0


@pytest.mark.parametrize("beta", [0.0, 0.3, 1.0])
def test_cylinder(beta: float) -> None:
    # cos of half the arc in shadow: sqrt(r^2 - R^2) / (r cos beta)
    radius = 6.878e6
    half = math.acos(math.sqrt(radius**2 - EARTH**2) / (radius * math.cos(beta)))
    # the Sun's parallax moves the edge by 5e-5 rad, and more where the arc grazes the shadow
    assert seen(half - 2e-4, radius, 0.0, beta) == 0.0
    assert seen(half + 2e-4, radius, 0.0, beta) == 1.0


@pytest.mark.parametrize("part", [0.1, 0.5, 0.8])
def test_half_way_is_the_discs_overlap(part: float) -> None:
    # the area of the Sun's disc above the limb, a circle on the sky's plane
    radius = 42.164e6
    a, b = SUN_RADIUS / (ASTRONOMICAL_UNIT + radius), math.asin(EARTH / radius)
    c = b - a + 2.0 * a * part
    covered, _ = dblquad(
        lambda y, x: 1.0,
        c - a,
        min(b, c + a),
        lambda x: -math.sqrt(max(0.0, min(a**2 - (x - c) ** 2, b**2 - x**2))),
        lambda x: math.sqrt(max(0.0, min(a**2 - (x - c) ** 2, b**2 - x**2))),
        epsrel=1e-7,
    )
    # place where the centre of the Sun is c off that of the Earth; parallax 3e-4 of c is solved for
    angle = brentq(lambda v: c - v + math.asin(radius * math.sin(v) / ASTRONOMICAL_UNIT), 0, 1)
    # a by sine and not arcsine, and the Sun's distance: 1e-4 of the penumbra
    assert seen(angle, radius) == pytest.approx(1.0 - covered / (math.pi * a**2), abs=3e-4)


@given(st.floats(0.0, math.pi), st.floats(6.4e6, 5e7), st.floats(0.0, 1.5))
def test_it_is_a_part_and_grows_outwards(angle: float, radius: float, beta: float) -> None:
    one, other = seen(angle, radius, beta=beta), seen(min(angle + 1e-3, math.pi), radius, beta=beta)
    assert 0.0 <= one <= 1.0
    assert other >= one - 1e-8  # rounding of the overlap


def test_beyond_the_tip_of_the_umbra_a_ring_is_left() -> None:
    far = 2e9
    ratio = math.asin(EARTH / far) / math.asin(SUN_RADIUS / (ASTRONOMICAL_UNIT + far))
    assert seen(0.0, far) == pytest.approx(1.0 - ratio**2, rel=1e-12)
