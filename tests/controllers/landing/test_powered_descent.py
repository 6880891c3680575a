"""The descent from orbit: its phases, its limits, and a flight of a point mass from dispersions."""

from typing import Any

import numpy as np
import pytest
from mjspace.controllers.landing.landing_site import LandingSite, SiteReference
from mjspace.controllers.landing.powered_descent import VERTICAL, PoweredDescent, State

from mjspace.contract import Array, Measurement

PERIOD = 0.5
LAW = PoweredDescent(
    control_period=PERIOD, mass=175.0, tank=95.0, thrust_range=np.array([52.0, 520.0])
)
START = np.array([457598.0, 2000.0, -45780.0])
SPEED = np.array([-1633.24, 0.0, 441.65])


def reference(count: int, safe: Array | None = None) -> SiteReference:
    rows = LandingSite().at(np.zeros(count))
    return rows if safe is None else rows._replace(safe_site=rows.position + safe)


def seen(position: Array, velocity: Array, burnt: float | Array = 0.0) -> Measurement:
    """Return what is measured of upright vehicles at rest in attitude, (n, ...)."""
    count = len(position)
    return Measurement(
        attitude=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        rate=np.zeros((count, 3)),
        position=position,
        velocity=velocity,
        propellant=95.0 - np.broadcast_to(burnt, (count, 1)),
        contact=np.zeros((count, 1)),
    )


def desired_force(law: PoweredDescent, state: Any, at: Measurement, wanted: SiteReference) -> Array:
    """Return the thrust [N] that the law wants, world axes, (n, 3).

    For an upright vehicle at rest the pointing error is the direction's x and y.
    """
    _, _, signals = law.step(state, 0.0, at, wanted)
    y, x = -signals.pointing_error[:, 0], signals.pointing_error[:, 1]
    up = signals.desired_thrust[:, 0]
    size = np.abs(up) / np.sqrt(1.0 - x**2 - y**2)
    return np.stack([size * x, size * y, up], axis=-1)


def flown(safe: Array, count: int = 12) -> tuple[Array, ...]:
    """Return what point masses are at touchdown: place, velocity, burnt; and the states there.

    Their thrust is what the law wants, within the engine's range.
    """
    rng = np.random.default_rng(0)
    p = START + rng.normal(0.0, [2000.0, 500.0, 300.0], (count, 3))
    v = SPEED + rng.normal(0.0, [3.0, 2.0, 2.0], (count, 3))
    burnt, state = np.zeros((count, 1)), None
    wanted = reference(count, safe)
    h = PERIOD
    for _ in range(1600):
        at = seen(p, v, burnt)
        state = LAW.reset(at, wanted) if state is None else state
        force = desired_force(LAW, state, at, wanted)
        size = np.linalg.norm(force, axis=-1, keepdims=True)
        thrust = np.clip(size, 52.0, 520.0)
        stands = (state.phase == VERTICAL) & (p[:, 2:] <= wanted.safe_site[:, 2:])
        a = thrust / size * force / (175.0 - burnt) + LAW.gravity(p)
        a = np.where(stands, 0.0, a)
        p = np.where(stands, p, p + h * v + 0.5 * h**2 * a)
        v = v + h * a
        burnt = burnt + np.where(stands, 0.0, h * thrust / (311.0 * 9.80665))
        state = LAW.step(state, 0.0, at, wanted)[0]
        if stands.all():
            return p - wanted.safe_site, v, burnt, state.phase
    raise AssertionError("not all have landed")


def test_point_masses_land_from_dispersed_orbits_on_the_safe_site() -> None:
    away, velocity, burnt, phase = flown(np.array([30.0, -40.0, 2.0]))
    assert np.all(phase == 2.0)
    # Half a second of descent lies between two looks.
    assert np.all(np.hypot(away[:, 0], away[:, 1]) < 0.05)
    assert np.all(np.abs(velocity[:, :2]) < 0.02)
    assert np.all((velocity[:, 2] > -0.6) & (velocity[:, 2] < -0.45))
    # An impulse of the orbit's speed alone would burn 74.6 kg (Tsiolkovsky).
    assert np.all((burnt > 80.0) & (burnt < 88.0))


def test_the_phases_follow_one_another_and_the_divert_begins_at_the_high_gate() -> None:
    safe = np.array([30.0, -40.0, 2.0])
    wanted = reference(3, safe)
    near = wanted.position + np.array([[6e3, 0.0, 2e3], [30.1, -40.0, 34.0], [30.0, -40.0, 22.0]])
    speed = np.array([[-152.0, 0.0, -46.0], [-0.2, 0.0, -2.1], [0.0, 0.0, -1.0]])
    at = seen(near, speed, 80.0)
    state = State(
        np.zeros((3, 1)), np.array([[0.0], [1.0], [2.0]]), np.array([[1.0], [1.0], [9.0]])
    )
    after, _, signals = LAW.step(state, 0.0, at, wanted)
    assert np.array_equal(after.phase[:, 0], [1.0, 2.0, 2.0])
    assert np.array_equal(signals.site[0], wanted.position[0])
    assert np.array_equal(signals.site[1:], wanted.safe_site[1:])
    assert after.time_to_go[0, 0] == LAW.approach_time


def test_above_the_site_the_speed_follows_the_height() -> None:
    wanted = reference(2)
    height = np.array([20.0, -1.0])
    place = wanted.position + height[:, None] * np.array([0.0, 0.0, 1.0])
    down = -(0.5 + np.maximum(height, 0.0) / 20.0)
    at = seen(place, down[:, None] * np.array([0.0, 0.0, 1.0]), 82.0)
    state = LAW.reset(at, wanted)._replace(phase=np.full((2, 1), 2.0))
    weight = -93.0 * LAW.gravity(place)[:, 2]
    slows = np.array([1.5 / 20.0, 0.0]) * 93.0
    found = desired_force(LAW, state, at, wanted)
    assert found[:, 2] == pytest.approx(weight + slows, rel=1e-12)
    assert found[:, :2] == pytest.approx(np.zeros((2, 2)), abs=1e-9)


def test_more_thrust_than_there_is_keeps_its_direction() -> None:
    wanted = reference(1)
    at = seen(np.array([[6e3, 0.0, 2e3]]), np.array([[-150.0, 0.0, -45.0]]))
    state = LAW.reset(at, wanted)._replace(phase=np.ones((1, 1)), time_to_go=np.full((1, 1), 100.0))
    strong = PoweredDescent(
        control_period=PERIOD, mass=175.0, tank=95.0, thrust_range=np.array([52.0, 5e4])
    )
    free, kept = (desired_force(law, state, at, wanted)[0] for law in (strong, LAW))
    assert np.linalg.norm(free) > 520.0
    assert np.linalg.norm(kept) == pytest.approx(520.0)
    assert kept / 520.0 == pytest.approx(free / np.linalg.norm(free))


def test_one_of_many_is_led_as_alone_and_turned_axes_turn_all() -> None:
    wanted, safe = reference(2), np.array([5.0, 2.0, 0.0])
    at = seen(np.stack([START, START + 900.0]), np.stack([SPEED, SPEED]))
    both = LAW.step(LAW.reset(at, wanted), 0.0, at, wanted)
    alone = at._map(lambda a: a[1])
    row = SiteReference(*(part[1] for part in wanted))
    one = LAW.step(LAW.reset(alone, row), 0.0, alone, row)
    for many, single in zip(both, one, strict=True):
        for field, other in zip(many, single, strict=True):
            assert np.array_equal(field[1], other)
    angle = 0.7
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    law = PoweredDescent(
        control_period=PERIOD,
        mass=175.0,
        tank=95.0,
        thrust_range=np.array([52.0, 520.0]),
        azimuth=angle,
    )
    turned = seen(at.position @ turn.T, at.velocity @ turn.T)
    state = law.reset(turned, reference(2, safe))
    expected = desired_force(LAW, LAW.reset(at, wanted), at, wanted)
    assert desired_force(law, state, turned, wanted) == pytest.approx(expected @ turn.T, rel=1e-9)


def test_the_height_is_that_above_the_sphere() -> None:
    above = 15e3
    angle = START[0] / LAW.moon_radius
    place = (LAW.moon_radius + above) * np.array([np.sin(angle), 0.0, np.cos(angle)])
    place[2] -= LAW.moon_radius
    assert LAW.altitude(place) == pytest.approx(above, abs=1e-8)
    assert LAW.altitude(np.array([0.0, 0.0, 1.8])) == pytest.approx(1.8, abs=1e-15)
    step = 1e-3 * np.array([0.3, -0.5, 0.8])
    change = LAW.altitude(place + step) - LAW.altitude(place)
    assert change == pytest.approx(LAW.upward(place) @ step, abs=1e-8)
