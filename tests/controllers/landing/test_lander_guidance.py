"""The descent that saves propellant: its flight, and how much less it burns."""

from functools import cache

import numpy as np
import pytest
from lander_laws import LANDS
from lander_oracle import Flight, Start, Vehicle, fly
from mjspace.controllers.landing.bezier import curve
from mjspace.controllers.landing.descent import SineDescent, powered
from mjspace.controllers.landing.guidance import BezierDescent
from mjspace.controllers.landing.lander_vectoring import ThrustVectoring

LAW = ThrustVectoring(control_period=0.02)
LAGS = {"thrust_lag": 0.1, "gimbal_lag": 0.05, "gimbal_rate": np.radians(20.0)}


def test_it_follows_its_curve_in_the_plane_of_its_azimuth_and_then_its_last_speed() -> None:
    points = np.random.default_rng(5).normal(size=(7, 3)) * 10.0
    azimuth, stance = 0.5, 1.3
    descent = BezierDescent(duration=20.0, points=points, azimuth=azimuth, stance=stance)
    c, s = np.cos(azimuth), np.sin(azimuth)
    to_world = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def world(time: np.ndarray) -> list[np.ndarray]:
        """Return the motion on the curve, of the vehicle's origin."""
        motion = [part @ to_world.T for part in curve(points, 20.0, time / 20.0)]
        motion[0] = motion[0] + [0.0, 0.0, stance]
        return motion

    time = np.array([0.0, 3.0, 11.0, 20.0])
    expected = powered(world(time), azimuth, 4.902e12, 1.738e6)
    for one, other in zip(descent.at(time), expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)

    place, velocity, *_ = world(np.full(2, 20.0))
    late = np.array([0.5, 30.0])
    coasting = [place + late[:, None] * velocity, velocity, *np.zeros((3, 2, 3))]
    expected = powered(coasting, azimuth, 4.902e12, 1.738e6)
    for one, other in zip(descent.at(20.0 + late), expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)


def test_its_curve_is_that_of_the_soles_1_8_m_below_the_origin() -> None:
    """As they are on the lander, which starts 1000 m up and 2500 m away, 3 to 4 of it along y."""
    start = BezierDescent().at(np.zeros(1)).position[0]
    np.testing.assert_allclose(start, [2000.0, 1500.0, 1001.8], rtol=0.0, atol=0.02)


@pytest.mark.parametrize(
    ("gain", "admitted", "refused"),
    [
        ("duration", 0.5, 0.0),
        ("azimuth", 2.0 * np.pi, 6.3),
        ("azimuth", -2.0 * np.pi, -6.3),
        ("stance", 0.0, -0.5),
        ("gravity_parameter", 0.5, 0.0),
        ("moon_radius", 0.5, 0.0),
        ("points", np.eye(5, 3), np.eye(4, 3)),
    ],
)
def test_a_descent_that_cannot_be_is_refused(gain: str, admitted: object, refused: object) -> None:
    BezierDescent(**{gain: admitted})
    with pytest.raises(ValueError, match=gain):
        BezierDescent(**{gain: refused})


@cache
def nominal() -> Flight:
    return fly(LAW, BezierDescent(), duration=100.0, ground=0.0)


def test_it_lands_softly_with_less_than_half_of_the_propellant() -> None:
    flight = nominal()
    assert flight.time[-1] == pytest.approx(83.4, abs=0.1)
    assert -flight.velocity[-1, 2] == pytest.approx(0.5, abs=0.01)
    assert np.hypot(*flight.velocity[-1, :2]) < 0.01  # 0.004
    assert np.degrees(flight.tilt[-1]) < 0.5  # 0.26
    assert np.hypot(*flight.position[-1, :2]) < 0.3  # 0.15
    assert np.linalg.norm(flight.error, axis=-1).max() < 0.5
    hovering = SineDescent(clearance=2.0, hover=10.0)
    papers = fly(LANDS, hovering, duration=230.0, ground=0.0).propellant[-1]
    assert flight.propellant[-1] == pytest.approx(5.34, abs=0.01)
    assert 1.0 - flight.propellant[-1] / papers == pytest.approx(0.534, abs=0.002)


@pytest.mark.parametrize("seed", range(4))
def test_it_lands_from_elsewhere_with_another_mass_behind_lags(seed: int) -> None:
    rng = np.random.default_rng(seed)

    def within(spread: float, count: int = 3) -> list[float]:
        return list(rng.uniform(-spread, spread, count))

    (up, out, across), (climb, away, turn) = within(20.0), within(2.0)
    start = Start(
        1000.0 + up, 2500.0 + out, 0.6435 + across / 2500.0,
        -10.0 + climb, -24.0 + away, -0.0028 + turn / 2500.0,
        tuple(np.radians(within(3.0))), tuple(np.radians(within(0.5))),
    )  # fmt: skip
    inertia = tuple(np.array([100.0, 90.0, 80.0]) * (1.0 + np.array(within(0.2))))
    vehicle = Vehicle(100.0 + within(5.0)[0], inertia, depletes=1.0, **LAGS)
    flight = fly(LAW, BezierDescent(), duration=100.0, start=start, vehicle=vehicle, ground=0.0)
    # Thirty others: 0.65 and 0.20 m/s, 1.3 deg, 1.5 m, 5.6 kg at most.
    assert -flight.velocity[-1, 2] < 0.75
    assert np.hypot(*flight.velocity[-1, :2]) < 0.3
    assert np.degrees(flight.tilt[-1]) < 2.0
    assert np.hypot(*flight.position[-1, :2]) < 2.5
    assert flight.propellant[-1] < 5.8


def test_what_the_reference_wants_is_fed_forward() -> None:
    """Without the wanted rate, the tilt lags behind and the place is lost."""

    class Blind(BezierDescent):
        def at(self, time: np.ndarray) -> object:
            wanted = super().at(time)
            still = np.zeros_like(wanted.rate)
            return wanted._replace(rate=still, acceleration=still)

    flight = fly(LAW, Blind(), duration=70.0)
    assert np.abs(flight.error).max() > 10.0 * np.abs(nominal().error).max()
