"""The ephemeris that references are handed: what the environment flies by, and its derivatives."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from orbit_samples import ORBITS, ephemeris

from mjspace import attitude
from mjspace.environment import kepler, sun
from mjspace.environment.constants import GM
from mjspace.environment.earth_rotation import sidereal_angle
from mjspace.environment.ephemeris import KnownEphemeris
from mjspace.environment.orbit import orbit_position
from mjspace.errors import InputError
from mjspace.scenario.environment import Environment
from mjspace.scenario.loading import load
from mjspace.scenario.scenario import Component
from mjspace.simulation.assembly import assemble
from mjspace.simulation.user_code import reference_at

TIMES = np.linspace(-100.0, 20000.0, 1777)


@pytest.mark.parametrize("orbit", ORBITS)
def test_the_origin_is_where_the_flight_has_it(orbit: str) -> None:
    known = ephemeris(orbit)
    place = orbit_position(known.environment.orbit, TIMES)
    # 4e-8 measured, by the mean anomaly's rounding after some turns.
    np.testing.assert_allclose(known.origin(TIMES).position, place, rtol=0.0, atol=2e-7)


@pytest.mark.parametrize("eccentricity", [0.0, 0.1, 0.7, 0.9])
def test_its_derivatives_are_those_of_keplers_orbit(eccentricity: float) -> None:
    axis = 7e6 / (1.0 - eccentricity)
    known = ephemeris("inclined", eccentricity=eccentricity, semi_major_axis=axis)
    elements = known.environment.orbit.elements()
    path = known.origin(TIMES)
    p, v = path.position, np.array([kepler.velocity(elements, t) for t in TIMES])
    radius = np.linalg.norm(p, axis=-1, keepdims=True)
    pull = -GM["earth"] * p / radius**3
    along = np.sum(p * v, axis=-1, keepdims=True)
    change = -GM["earth"] * (v / radius**3 - 3.0 * along * p / radius**5)
    # Of the largest: 6e-13, 4e-11 and 2e-9 measured.
    for found, wanted, tolerance in (
        (path.velocity, v, 3e-12),
        (path.acceleration, pull, 2e-10),
        (path.jerk, change, 1e-8),
    ):
        assert np.abs(found - wanted).max() < tolerance * np.abs(wanted).max()


def test_the_sun_is_that_of_the_environment_and_moves_a_degree_a_day() -> None:
    known = ephemeris("circle")
    assert known.environment.epoch is not None
    path = known.sun(TIMES)
    place = sun.position(known.environment.epoch, TIMES)
    np.testing.assert_allclose(path.position, place, rtol=1e-15, atol=1.0)
    later = sun.position(known.environment.epoch, TIMES + 60.0)
    before = sun.position(known.environment.epoch, TIMES - 60.0)
    np.testing.assert_allclose(path.velocity, (later - before) / 120.0, atol=1e-3)
    assert np.linalg.norm(path.velocity[0]) == pytest.approx(29.7e3, rel=0.02)


def test_the_earth_turns_as_under_its_magnetic_field() -> None:
    known = ephemeris("circle")
    assert known.environment.epoch is not None
    angle = sidereal_angle(known.environment.epoch) + 7.292115e-5 * 300.0
    found = known.fixed_to_earth(np.array([2.0, 0.0, 1.0]), np.array([300.0]))
    np.testing.assert_allclose(
        found.position[0], [2.0 * np.cos(angle), 2.0 * np.sin(angle), 1.0], atol=1e-14
    )
    axis = np.array([0.0, 0.0, 7.292115e-5])
    for lower, higher in pairwise(found):
        np.testing.assert_allclose(higher, np.cross(axis, lower), rtol=1e-14, atol=1e-30)


@pytest.mark.parametrize(
    ("environment", "ask", "message"),
    [
        ({}, lambda k: k.origin(TIMES), r"add \[environment.orbit\]"),
        ({"orbit": ORBITS["circle"]}, lambda k: k.sun(TIMES), "add environment.epoch"),
        (
            {"orbit": ORBITS["circle"]},
            lambda k: k.fixed_to_earth(np.ones(3), TIMES),
            "add environment.epoch",
        ),
        (
            {"orbit": {"body": "moon", "semi_major_axis": 2e6}, "epoch": "2026-01-01T00:00:00"},
            lambda k: k.sun(TIMES),
            "around the Earth",
        ),
    ],
)
def test_what_is_not_known_is_refused(environment: Any, ask: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ask(KnownEphemeris(Environment(**environment)))


def in_orbit(**reference: Any) -> Any:
    """Return a scenario in orbit with a reference, by its gains."""
    scenario, _ = load("lqr-gravity-gradient")
    return scenario.model_copy(update={"reference": Component(**reference), "duration": 10.0})


def test_a_reference_is_handed_it_and_the_flown_scenario_says_nothing_of_it() -> None:
    assembly = assemble(in_orbit(kind="pointing:Nadir"), Path())
    desired = reference_at(assembly.reference, np.array([5.0]))
    place = orbit_position(assembly.scenario.environment.orbit, 5.0)
    down = attitude.rotate(desired.attitude[0], np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(down, -attitude.normalize(place), atol=1e-15)
    np.testing.assert_allclose(desired.rate[0, 1], -2.0 * np.pi / 5600.0, rtol=1e-12)
    assert assembly.scenario.reference.gains == {"offset": [1.0, 0.0, 0.0, 0.0]}


@pytest.mark.parametrize(
    ("overrides", "reference", "message"),
    [
        (
            ["environment.orbit"],
            {"kind": "pointing:Nadir"},
            r"^reference: it points by the orbit: add \[environment.orbit\]$",
        ),
        (
            [],
            {"kind": "pointing:SunPointing"},
            "^reference: it points by the Sun.*environment.epoch$",
        ),
        (
            [],
            {"kind": "pointing:Nadir", "ephemeris": 3},
            "^reference: ephemeris: .* environment: leave it out$",
        ),
        (
            [],
            {"kind": "targets:SpacecraftTarget", "target": {"kind": "pointing:Nadir"}},
            "^reference: target: Nadir has no position$",
        ),
    ],
)
def test_a_scenario_without_what_it_needs_is_refused_in_one_line(
    overrides: list[str], reference: dict[str, Any], message: str
) -> None:
    scenario = in_orbit(**reference)
    if overrides:
        scenario = scenario.model_copy(update={"environment": Environment()})
    with pytest.raises(InputError, match=message):
        assemble(scenario, Path())
