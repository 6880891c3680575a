"""Slews between references: the double S within its limits, and motions that pass over smoothly."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mjspace.controllers.references.double_s import quickest
from mjspace.controllers.references.pointing import Nadir, SunPointing
from mjspace.controllers.references.references import Hold, Turning
from mjspace.controllers.references.slews import Phase, Slews
from mjspace.controllers.references.targets import GroundTarget
from orbit_samples import agreement, ephemeris

from mjspace import attitude as att
from mjspace.contract import Array

LIMITS = (0.02, 0.002, 0.0005)
positive = st.floats(1e-3, 1e3)


@given(angle=positive, rate=positive, acceleration=positive, jerk=positive)
def test_a_double_s_reaches_its_angle_within_its_limits(
    angle: float, rate: float, acceleration: float, jerk: float
) -> None:
    profile = quickest(angle, rate, acceleration, jerk)
    time = np.linspace(0.0, profile.duration, 5001)
    rise, slope, bend = (angle * each for each in profile.motion(time))
    np.testing.assert_allclose([rise[0], slope[0], bend[0]], 0.0, atol=1e-12 * angle)
    assert rise[-1] == pytest.approx(angle, rel=1e-9)
    assert slope[-1] == pytest.approx(0.0, abs=1e-9 * jerk * profile.jerk_time * profile.duration)
    # The time in the last segment is rounded to 2e-16 of the whole.
    assert bend[-1] == pytest.approx(0.0, abs=jerk * (1e-9 * profile.jerk_time + 1e-14 * time[-1]))
    assert slope.max() < (1.0 + 1e-6) * rate
    assert np.abs(bend).max() < (1.0 + 1e-6) * acceleration
    # It is the quickest that has a limit reached in every segment: that of the jerk, always; of the
    # acceleration or the rate, where it is steady or cruises.
    assert angle * profile.jerk == pytest.approx(jerk, rel=1e-6)
    _, _, steady = profile.motion(np.array([profile.jerk_time]))
    if profile.steady_time > 1e-6 * profile.duration:
        assert angle * steady[0] == pytest.approx(acceleration, rel=1e-6)
    if profile.cruise_time > 1e-6 * profile.duration:
        _, cruises, _ = profile.motion(np.array([0.5 * profile.duration]))
        assert angle * cruises[0] == pytest.approx(rate, rel=1e-6)


def test_a_known_double_s() -> None:
    # Biagiotti and Melchiorri, example 3.9: h = 10, limits 5, 10, 30: Tj = 0.3333, Ta = 0.8333,
    # Tv = 1.1667.
    profile = quickest(10.0, 5.0, 10.0, 30.0)
    np.testing.assert_allclose(
        [profile.jerk_time, 2 * profile.jerk_time + profile.steady_time, profile.cruise_time],
        [1.0 / 3.0, 5.0 / 6.0, 7.0 / 6.0],
        rtol=1e-12,
    )


def sources() -> dict[str, Any]:
    known = ephemeris("inclined")
    return {
        "rest": (Hold(), Hold(att.from_euler_zyx(np.array([2.0, 0.3, -1.0])))),
        "orbit": (Nadir(known), SunPointing(known)),
        "target": (Nadir(known), GroundTarget(known, 0.5, 1.0)),
        "spins": (Turning(np.array([0.0, 0.004, 0.003])), Turning(np.array([-0.005, 0.0, 0.0]))),
        "none": (Nadir(known), Nadir(known)),
    }


def slewing(name: str) -> Slews:
    one, other = sources()[name]
    return Slews([Phase(one), Phase(other, 100.0), Phase(one, 700.0)], *LIMITS)


SLEWS = {name: slewing(name) for name in sources()}


def segments(source: Slews) -> Array:
    """Return when segments of the slews begin and end [s]."""
    found = []
    for slew in source.slews:
        found += [slew.start, *(slew.start + slew.profile.ends)]
    return np.array(found)


@pytest.mark.parametrize("name", SLEWS)
def test_rate_and_acceleration_are_derivatives_during_slews_too(name: str) -> None:
    source = SLEWS[name]
    times = np.linspace(50.0, 1100.0, 700)
    step = 0.05
    off = np.abs(times[:, None] - segments(source)).min(axis=1) > 5.0 * step
    # Of the eighth order; a tenth of it measured.
    rate, acceleration = agreement(source, times[off], step)
    assert rate < 1e-9
    assert acceleration < 1e-9


@pytest.mark.parametrize("name", SLEWS)
def test_a_slew_starts_and_ends_on_the_moving_references(name: str) -> None:
    source, tiny = SLEWS[name], 1e-9
    for slew in source.slews:
        for instant in (slew.start, slew.end):
            before, after = (source.at(np.full(1, instant + s * tiny)) for s in (-1.0, 1.0))
            for one, other, step in zip(before, after, (1e-9, 1e-10, 1e-8), strict=True):
                np.testing.assert_allclose(one, other, rtol=0.0, atol=step)
    times = np.linspace(0.0, 1200.0, 2401)
    path = source.at(times).attitude
    assert np.sum(path[1:] * path[:-1], axis=-1).min() > 0.99


@pytest.mark.parametrize("name", SLEWS)
def test_a_slew_keeps_its_limits_and_none_is_needlessly_slow(name: str) -> None:
    source = SLEWS[name]
    for slew in source.slews:
        times = np.linspace(slew.start, slew.end, 4001)
        motion = source.at(times)
        rate, acceleration = (np.linalg.norm(each, axis=-1).max() for each in motion[1:])
        # Held at 400 samples and the segments' ends.
        assert rate < 1.0001 * LIMITS[0]
        assert acceleration < 1.0001 * LIMITS[1]
        if name != "none":
            assert max(rate / LIMITS[0], acceleration / LIMITS[1]) > 0.93


def test_between_rests_it_is_the_quickest_turn_about_the_eigenaxis() -> None:
    source = SLEWS["rest"]
    one, other = (phase.reference.attitude for phase in source.phases[:2])
    angle = att.rotation_angle(one, other)
    assert source.slews[0].profile.duration == pytest.approx(quickest(angle, *LIMITS).duration)
    rates = source.at(np.linspace(101.0, source.slews[0].end - 1.0, 50)).rate
    axis = att.normalize(rates)
    np.testing.assert_allclose(axis, np.tile(axis[0], (50, 1)), atol=1e-12)


def test_after_a_slew_it_is_the_reference_that_is_flown() -> None:
    one, other = sources()["target"]
    source = SLEWS["target"]
    for reference, time in ((one, 50.0), (other, 500.0), (one, 1000.0)):
        wanted, found = reference.at(np.full(1, time)), source.at(np.full(1, time))
        assert att.rotation_angle(wanted.attitude, found.attitude)[0] < 1e-15
        np.testing.assert_array_equal(found.rate, wanted.rate)
        np.testing.assert_array_equal(found.acceleration, wanted.acceleration)


@pytest.mark.parametrize(
    ("phases", "message"),
    [
        ([], "phases: got none"),
        (3, "phases: got 3, should be a list"),
        ([Phase(Hold()), Phase(Hold(), 0.0)], r"phases.1.start: got 0 s, should be after"),
        (
            [Phase(Hold()), Phase(Turning(np.array([0.1, 0.0, 0.0])), 1.0)],
            "phases.1: no slew from 1 s on is within rate_limit",
        ),
        (
            [
                Phase(Hold()),
                Phase(Hold(np.array([0.0, 1.0, 0.0, 0.0])), 1.0),
                Phase(Hold(), 100.0),
            ],
            r"phases.2.start: got 100 s, but the slew of the phase before lasts until 1[67]\d",
        ),
    ],
)
def test_what_cannot_be_flown_is_refused(phases: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Slews(phases, *LIMITS).at(np.array([0.0]))


def test_a_phase_is_a_reference() -> None:
    with pytest.raises(ValueError, match="reference: got 3, should be a table"):
        Phase(3)
