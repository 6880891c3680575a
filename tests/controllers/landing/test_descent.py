"""Wanted descents: the paper's figures, the derivatives, and the thrust that they need."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.landing.descent import CubicDescent, SineDescent
from mjspace.controllers.landing.guidance import BezierDescent

from mjspace import attitude as att

MU, RADIUS = 4.902e12, 1.738e6
SOURCES = {
    "sine": SineDescent(),
    "cubic": CubicDescent(duration=60.0),  # quick enough for its rate to be seen
    "bezier": BezierDescent(),
}
sources = pytest.mark.parametrize("source", SOURCES.values(), ids=SOURCES)


@sources
def test_each_is_the_derivative_of_the_one_before(source: Any) -> None:
    t, h = np.linspace(0.5, source.duration - 0.5, 60), 1e-3
    now, ahead, behind = source.at(t), source.at(t + h), source.at(t - h)

    def slope(name: str) -> Any:
        return (getattr(ahead, name) - getattr(behind, name)) / (2.0 * h)

    # Of central differences: rounding, 1e-13 m in 1e-3 s, and h^2/6 times the third derivative.
    np.testing.assert_allclose(slope("position"), now.velocity, atol=1e-6)
    np.testing.assert_allclose(slope("velocity"), now.linear_acceleration, atol=1e-6)
    np.testing.assert_allclose(slope("rate"), now.acceleration, atol=1e-6)
    turn = 2.0 * att.multiply(att.conjugate(now.attitude), slope("attitude"))[:, 1:]
    np.testing.assert_allclose(turn, now.rate, atol=1e-6)
    assert np.abs(now.rate).max() > 1e-4
    assert np.abs(now.acceleration).max() > 1e-6


@sources
def test_an_instant_is_the_same_bits_alone_as_among_others(source: Any) -> None:
    """A flight asks for as many instants as a block has: that must not show in its numbers."""
    times = np.linspace(0.0, 1.2 * source.duration, 400)
    together = source.at(times)
    for k in range(0, 399, 7):
        for count in (1, 2):
            for one, other in zip(source.at(times[k : k + count]), together, strict=True):
                assert one.tobytes() == other[k : k + count].tobytes()


@sources
def test_its_axis_is_along_the_thrust_that_it_needs(source: Any) -> None:
    wanted = source.at(np.linspace(0.0, 1.2 * source.duration, 50))
    away = wanted.position + np.array([0.0, 0.0, RADIUS])
    gravity = -MU * away / np.linalg.norm(away, axis=1, keepdims=True) ** 3
    thrust = wanted.linear_acceleration - gravity
    axis = att.rotate(wanted.attitude, np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(np.cross(axis, thrust), 0.0, atol=1e-12)
    assert np.all(axis[:, 2] > 0.6)


def test_the_papers_table_2() -> None:
    source = SineDescent(stance=0.0)
    start, end = (source.at(np.array([t])) for t in (0.0, 200.0))
    c, s = np.cos(0.6435), np.sin(0.6435)
    np.testing.assert_allclose(start.position[0], [2500.0 * c, 2500.0 * s, 1000.0], atol=1e-9)
    # Table 3's velocity, -24 and -10 m/s, is off by -4.37 and -2.15 m/s.
    away = start.velocity[0] @ [c, s, 0.0]
    assert -24.0 - away == pytest.approx(-4.37, abs=0.01)
    assert -10.0 - start.velocity[0, 2] == pytest.approx(-2.15, abs=0.01)
    # Erratum 20: it ends at rest, with 0.062 and 0.154 m/s^2, tilted by 5.23 deg.
    np.testing.assert_allclose(end.position[0], 0.0, atol=1e-12)
    acceleration = end.linear_acceleration[0]
    assert acceleration[2] == pytest.approx(0.062, abs=5e-4)
    assert acceleration[:2] @ [c, s] == pytest.approx(0.154, abs=5e-4)
    axis = att.rotate(end.attitude, np.array([0.0, 0.0, 1.0]))[0]
    assert np.degrees(np.arccos(axis[2])) == pytest.approx(5.23, abs=0.01)


def test_attitude_is_gamma_d_in_the_plane_of_theta_d() -> None:
    """psi = theta_d about Xb, then gamma_d about Zb: our z, then our y."""
    source, time = SineDescent(stance=0.0), np.array([0.0, 70.0, 199.0])
    wanted = source.at(time)
    a = np.pi / 400.0
    s = np.sin(a * time)
    x, r, slowing = RADIUS + 1000.0 * (1.0 - s), 2500.0 * (1.0 - s), a * a * s
    pull = MU / (x * x + r * r) ** 1.5
    gamma = np.arctan2(2500.0 * slowing + pull * r, 1000.0 * slowing + pull * x)
    yaw = att.from_rotation_vector(np.array([0.0, 0.0, 0.6435]))
    tilt = att.from_rotation_vector(gamma[:, None] * [0.0, 1.0, 0.0])
    np.testing.assert_allclose(wanted.attitude, att.multiply(yaw, tilt), atol=1e-15)


def test_hover_and_touchdown() -> None:
    source = SineDescent(clearance=2.0, hover=10.0)
    time = np.array([0.0, 200.0, 205.0, 210.0, 214.0, 220.0])
    wanted = source.at(time)
    assert wanted.position[:, 2] == pytest.approx([1003.8, 3.8, 3.8, 3.8, 1.8, -1.2])
    assert wanted.velocity[2:, 2] == pytest.approx([0.0, 0.0, -0.5, -0.5])
    np.testing.assert_allclose(wanted.attitude[2:], wanted.attitude[[2]] * np.ones((4, 1)))
    assert not wanted.linear_acceleration[2:].any()
    assert not wanted.rate[2:].any()


def test_cubic_starts_as_table_3_and_ends_upright() -> None:
    wanted = CubicDescent(stance=0.0).at(np.array([0.0, 300.0]))
    assert wanted.velocity[0, 2] == pytest.approx(-10.0)
    assert np.hypot(*wanted.velocity[0, :2]) == pytest.approx(25.0)
    assert np.abs(wanted.linear_acceleration[1]).max() == 0.0
    assert abs(att.rotate(wanted.attitude[1], np.array([0.0, 0.0, 1.0]))[2]) == 1.0


def test_bezier_starts_as_table_3_upright_and_ends_descending() -> None:
    wanted = BezierDescent(stance=0.0, azimuth=0.0).at(np.array([0.0, 79.346, 89.346]))
    np.testing.assert_allclose(wanted.position[0], [2500.0, 0.0, 1000.0])
    np.testing.assert_allclose(wanted.velocity[0], [-24.0, -7.0, -10.0], atol=2e-4)
    np.testing.assert_allclose(wanted.position[1:], [[0.0, 0.0, 2.0], [0.0, 0.0, -3.0]], atol=2e-3)
    np.testing.assert_allclose(wanted.velocity[1:], [[0.0, 0.0, -0.5]] * 2, atol=2e-4)
    # It accelerates straight down; gravity is 1.4e-3 rad off the vertical, 2.5 km away.
    np.testing.assert_allclose(wanted.linear_acceleration[:2, :2], 0.0, atol=2e-5)
    np.testing.assert_allclose(wanted.rate[:2], 0.0, atol=1e-3)
    assert not wanted.linear_acceleration[2].any()


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: SineDescent(duration=0.0), "duration: got 0 s"),
        (lambda: BezierDescent(duration=-1.0), "duration: got -1 s"),
        (lambda: BezierDescent(points=np.zeros((4, 3))), "got 4 rows, should be 5 or more"),
    ],
)
def test_what_cannot_be_is_refused(build: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        build()
