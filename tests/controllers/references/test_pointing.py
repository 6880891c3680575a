"""References that know the orbit: their parts agree, and their axes go where they should."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.references.pointing import Nadir, SunPointing, direction
from mjspace.controllers.references.relative_orbit import RelativeOrbit
from mjspace.controllers.references.targets import GroundTarget, SpacecraftTarget, geodetic
from mjspace.controllers.references.yaw_steering import YawSteering
from orbit_samples import ORBITS, agreement, ephemeris

from mjspace import attitude as att
from mjspace.contract import Array

TURN = att.from_euler_zyx(np.array([0.3, -0.2, 0.5]))
SOURCES: dict[str, Any] = {
    "nadir": Nadir,
    "offset": lambda known: Nadir(known, TURN),
    "sun": SunPointing,
    "sun by velocity": lambda known: SunPointing(
        known, np.array([1.0, 2.0, 0.0]), np.array([0.0, 0.0, 1.0]), "velocity"
    ),
    "ground": lambda known: GroundTarget(known, 0.7, -0.4, 300.0),
    "spacecraft": lambda known: SpacecraftTarget(
        known, RelativeOrbit(1.1e-3, height=300.0, across=100.0), RelativeOrbit(1.1e-3, height=1.0)
    ),
    "yaw steering": lambda known: YawSteering(known, 0.003),
}
TIMES = np.linspace(20.0, 9000.0, 91)


@pytest.mark.parametrize("orbit", ORBITS)
@pytest.mark.parametrize("name", SOURCES)
def test_rate_and_acceleration_are_the_attitudes_derivatives(name: str, orbit: str) -> None:
    source = SOURCES[name](ephemeris(orbit))
    # Of the eighth order, of which rounding over the step leaves 1e-15; 4e-13 measured, of the
    # polynomials' ends within the differences' reach.
    rate, acceleration = agreement(source, TIMES, step=2.0)
    assert rate < 1e-9
    assert acceleration < 1e-9


def body_vector(source: Any, vector: Array, times: Array) -> Array:
    """Return unit vectors along ``vector`` (n, 3), inertial axes, in the axes of the reference."""
    return att.rotate(att.conjugate(source.at(times).attitude), att.normalize(vector))


@pytest.mark.parametrize("orbit", ORBITS)
def test_nadir_is_the_local_vertical_and_horizontal(orbit: str) -> None:
    known = ephemeris(orbit)
    at = known.origin(TIMES)
    down = body_vector(Nadir(known), -at.position, TIMES)
    np.testing.assert_allclose(down, np.tile([0.0, 0.0, 1.0], (len(TIMES), 1)), atol=1e-15)
    normal = body_vector(Nadir(known), np.cross(at.position, at.velocity), TIMES)
    np.testing.assert_allclose(normal, np.tile([0.0, -1.0, 0.0], (len(TIMES), 1)), atol=1e-15)
    # The body's axes in the orbit's are those of the offset.
    found = att.multiply(
        att.conjugate(Nadir(known).at(TIMES).attitude), SOURCES["offset"](known).at(TIMES).attitude
    )
    assert att.rotation_angle(found, TURN).max() < 1e-14


def test_on_a_circle_nadir_turns_at_the_orbits_rate() -> None:
    wanted = Nadir(ephemeris("circle")).at(TIMES)
    rate = np.sqrt(3.986004418e14 / 7e6**3)
    np.testing.assert_allclose(wanted.rate, np.tile([0.0, -rate, 0.0], (len(TIMES), 1)), atol=1e-15)
    np.testing.assert_allclose(wanted.acceleration, 0.0, atol=1e-17)


@pytest.mark.parametrize("orbit", ORBITS)
def test_the_sun_is_on_its_axis_and_the_second_as_near_as_may_be(orbit: str) -> None:
    known = ephemeris(orbit)
    source = SunPointing(known, np.array([2.0, 0.0, 0.0]), np.array([1.0, 0.0, 3.0]), "nadir")
    sun = known.sun(TIMES).position - known.origin(TIMES).position
    np.testing.assert_allclose(
        body_vector(source, sun, TIMES), np.tile([1.0, 0.0, 0.0], (len(TIMES), 1)), atol=1e-15
    )
    down = body_vector(source, -known.origin(TIMES).position, TIMES)
    assert np.abs(down[:, 1]).max() < 1e-14  # in the plane of the two axes
    assert down[:, 2].min() > 0.0  # on the second's side


def test_a_place_on_the_earth_is_where_wgs_84_has_it() -> None:
    # NGA.STND.0036: semi-minor axis 6356752.3142 m.
    np.testing.assert_allclose(geodetic(0.0, 0.0, 0.0), [6378137.0, 0.0, 0.0], rtol=1e-15)
    np.testing.assert_allclose(
        geodetic(-0.5 * np.pi, 1.0, 0.0), [0.0, 0.0, -6356752.3142], atol=1e-4
    )
    # Vallado 2013, example 3-3: 34.352496 deg, 46.4464 deg, 5085.22 km.
    place = geodetic(*np.radians([34.352496, 46.4464]), 5085.22e3)
    np.testing.assert_allclose(place, [6524.834e3, 6862.875e3, 6448.296e3], atol=5.0)


def test_a_ground_target_turns_with_the_earth() -> None:
    known = ephemeris("inclined")
    source = GroundTarget(known, 0.7, -0.4, 300.0)
    target = known.fixed_to_earth(geodetic(0.7, -0.4, 300.0), TIMES).position
    sight = body_vector(source, target - known.origin(TIMES).position, TIMES)
    np.testing.assert_allclose(sight, np.tile([0.0, 0.0, 1.0], (len(TIMES), 1)), atol=1e-14)
    a_day = 2.0 * np.pi / 7.292115e-5
    again = known.fixed_to_earth(geodetic(0.7, -0.4, 300.0), TIMES + a_day).position
    np.testing.assert_allclose(again, target, atol=1e-6)


def test_another_spacecraft_is_on_its_axis() -> None:
    target, own = RelativeOrbit(1.1e-3, height=300.0), RelativeOrbit(1.1e-3, height=20.0, phase=1.0)
    source = SpacecraftTarget(ephemeris("circle"), target, own)
    sight = target.at(TIMES).position - own.at(TIMES).position
    np.testing.assert_allclose(
        body_vector(source, sight, TIMES), np.tile([0.0, 0.0, 1.0], (len(TIMES), 1)), atol=1e-14
    )


@pytest.mark.parametrize("limit", [0.1, 0.01, 0.003])
@pytest.mark.parametrize("node", [0.0, 0.5, 3.0, 90.0, 200.0, 359.0])
def test_yaw_steering_turns_no_faster_than_its_limit(node: float, limit: float) -> None:
    known = ephemeris("circle", inclination=0.5, ascending_node=np.radians(node))
    source, nadir = YawSteering(known, limit), Nadir(known)
    times = np.linspace(0.0, 6000.0, 12001)
    orbits = nadir.at(times)
    relative = att.multiply(att.conjugate(orbits.attitude), source.at(times).attitude)
    yaw_rate = source.at(times).rate[:, 2] - orbits.rate[:, 2]
    np.testing.assert_allclose(relative[:, 1:3], 0.0, atol=1e-12)  # about the vertical alone
    assert np.abs(yaw_rate).max() < limit
    sun = body_vector(source, known.sun(times).position - known.origin(times).position, times)
    assert (sun[:, 0] > -limit).all()
    # Elsewhere it leaves the plane by t sqrt(f), 3 t^3 / sin^2 m.
    narrow, elsewhere = 1.078e-3 / limit, sun[:, 0] > 0.9
    if limit > 0.005 and elsewhere.any():
        assert np.abs(sun[elsewhere, 1]).max() < 4.0 * narrow**3


def test_yaw_steering_in_an_eccentric_orbit_is_a_little_faster() -> None:
    known, times = ephemeris("eccentric", ascending_node=2.0), np.linspace(0.0, 13000.0, 13001)
    yaw_rate = YawSteering(known, 0.01).at(times).rate - Nadir(known).at(times).rate
    assert np.abs(yaw_rate[:, 2]).max() < 0.0103


def test_yaw_steering_has_the_sun_in_its_plane_where_no_limit_matters() -> None:
    known = ephemeris("inclined")
    source = YawSteering(known, 1e3)
    sun = body_vector(source, known.sun(TIMES).position - known.origin(TIMES).position, TIMES)
    assert np.abs(sun[:, 1]).max() < 1e-11
    assert sun[:, 0].min() > 0.0


@pytest.mark.parametrize("name", SOURCES)
def test_the_quaternions_path_is_continuous_whatever_was_asked_before(name: str) -> None:
    source = SOURCES[name](ephemeris("inclined"))
    times = np.arange(0.0, 20000.0, 4.0)
    together = source.at(times).attitude
    assert np.sum(together[1:] * together[:-1], axis=-1).min() > 0.9
    if name not in ("sun", "sun by velocity", "spacecraft"):
        assert together[:, 0].min() < -0.1  # it goes round: the principal quaternion would jump
    fresh = SOURCES[name](ephemeris("inclined"))
    for i in np.random.default_rng(2).permutation(len(times))[:6]:
        np.testing.assert_array_equal(fresh.at(times[i : i + 1]).attitude[0], together[i])


def test_parallel_directions_are_refused_at_their_time() -> None:
    known = ephemeris("circle")
    source = SunPointing(known, second="sun")
    with pytest.raises(ValueError, match=r"SunPointing: at t = 3 s .* parallel"):
        source.at(np.array([3.0, 4.0]))


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda k: SunPointing(k, second="moon"), "second: got 'moon', should be one of 'nadir'"),
        (
            lambda k: SunPointing(k, second_axis=np.array([0.0, 0.0, -2.0])),
            "second_axis: .*parallel",
        ),
        (lambda k: GroundTarget(k, 2.0, 0.0), "latitude: got 2 rad"),
        (lambda k: SpacecraftTarget(k, 3.0), "target: got 3.0, should be a table"),
        (lambda k: YawSteering(k, 0.0), "rate_limit: got 0 rad/s"),
        (lambda k: SpacecraftTarget(k, Nadir(k)).at(TIMES), "target: Nadir has no position"),
    ],
)
def test_what_cannot_be_flown_is_refused(build: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        build(ephemeris("circle"))


def test_directions_are_those_of_the_orbit() -> None:
    known = ephemeris("inclined")
    at = known.origin(TIMES)
    for name, vector in (
        ("nadir", -at.position),
        ("velocity", at.velocity),
        ("orbit normal", np.cross(at.position, at.velocity)),
    ):
        found = direction(known, name, TIMES).value
        np.testing.assert_allclose(att.normalize(found), att.normalize(vector), atol=1e-15)
