"""The plan of a descent: within its limits, of least propellant, equal on any number of threads."""

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from mjspace.controllers.landing import guidance
from mjspace.controllers.landing.bezier import curve
from mjspace.controllers.landing.descent_limits import (
    Limits,
    keeps,
    least_propellant,
    shortest_duration,
)
from mjspace.controllers.landing.guidance import EXHAUST_SPEED, TABLE_3, burnt, plan

PLACE, VELOCITY = np.array([2500.0, 0.0, 1000.0]), np.array([-24.0, -7.0, -10.0])
ABOVE, AT_REST = np.array([100.0, 0.0, 100.0]), np.zeros(3)
MOON = Limits(
    mass=100.0,
    gravity=1.62283,
    thrust=(70.0, 270.0),
    tilt=np.radians(45.0),
    glide_slope=0.15,
    clearance=2.0,
    descent_speed=0.5,
)


def propellant(points: object, duration: float, limits: Limits = MOON) -> float:
    s = np.linspace(0.0, 1.0, 2001)
    felt = curve(np.asarray(points), duration, s)[2] + [0.0, 0.0, limits.gravity]
    return burnt(limits.mass * np.linalg.norm(felt, axis=-1), duration * s)


def test_the_plan_is_the_one_that_is_kept() -> None:
    duration, points = plan(PLACE, VELOCITY)
    kept = propellant(TABLE_3, 79.346)
    assert kept == pytest.approx(5.1325, abs=1e-4)
    assert propellant(points, duration) == pytest.approx(kept, abs=2e-4)
    assert duration == pytest.approx(79.346, abs=0.05)  # where the search stops
    assert np.abs(points - np.array(TABLE_3)).max() < 20.0
    same = least_propellant(79.346, PLACE, VELOCITY, MOON)[0]
    np.testing.assert_allclose(same, TABLE_3, rtol=0.0, atol=0.01)  # rounded to 0.0005
    for each, length in ((points, duration), (np.array(TABLE_3), 79.346)):
        assert keeps(each, length, PLACE, VELOCITY, MOON)


def test_what_is_kept_uses_its_limits_up() -> None:
    motion = curve(np.array(TABLE_3), 79.346, np.linspace(0.0, 1.0, 20001))
    felt = 100.0 * (motion[2] + [0.0, 0.0, 1.62283])
    size = np.linalg.norm(felt, axis=-1)
    assert size.min() == pytest.approx(70.24, abs=0.01)
    assert size.max() == pytest.approx(269.76, abs=0.01)
    assert np.degrees(np.arccos(felt[:, 2] / size).max()) == pytest.approx(44.95, abs=0.01)
    assert burnt(size, np.linspace(0.0, 79.346, 20001)) * EXHAUST_SPEED == pytest.approx(
        np.mean(0.5 * (size[1:] + size[:-1])) * 79.346
    )


@pytest.mark.parametrize(
    ("place", "velocity", "why"),
    [
        ((100.0, 0.0, 100.0), (-24.0, 0.0, -60.0), "full thrust does not brake it"),
        ((2500.0, 0.0, 300.0), (-24.0, -7.0, -10.0), "below the glide slope"),
        # 1000 m away: 150 m above the end, less a metre.
        ((600.0, 800.0, 150.9), (0.0, 0.0, -60.0), "below the glide slope"),
        ((600.0, 800.0, 151.1), (0.0, 0.0, -60.0), "full thrust does not brake it"),
        ((0.0, 0.0, 2.4), (0.0, 0.0, -0.5), "lasts between 0.601 and 0.8 s"),
        ((10.0, 0.0, 3.0), (20.0, 0.0, 0.0), "of 1.549 to 20.1 s keeps within the limits"),
    ],
)
def test_what_cannot_be_flown_is_refused(
    place: tuple[float, ...], velocity: tuple[float, ...], why: str
) -> None:
    with pytest.raises(ValueError, match=f"no descent from .* {why}"):
        plan(np.array(place), np.array(velocity))


class Costs:
    """Costs of durations instead of those of real descents, and the durations that were tried."""

    def __init__(self, cost: Callable[[float], float]) -> None:
        self.cost, self.tried = cost, list[float]()

    def least_propellant(self, duration: float, *_: object) -> tuple[np.ndarray, float]:
        self.tried.append(duration)
        return np.zeros((10, 3)), self.cost(duration)

    def plan(self, place: np.ndarray, velocity: np.ndarray) -> float:
        """Return the duration that the search finds."""
        self.tried.clear()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(guidance, "least_propellant", self.least_propellant)
            patch.setattr(guidance, "keeps", lambda *_: True)
            return plan(place, velocity)[0]


@pytest.mark.parametrize("best", [21.0, 33.3, 41.7, 100.0, 150.0, 190.0])
def test_the_search_finds_the_least_cost_to_a_twentieth_of_a_second(best: float) -> None:
    costs = Costs(lambda duration: 1000.0 + (duration - best) ** 2)
    assert costs.plan(ABOVE, AT_REST) == pytest.approx(best, abs=0.025)


@pytest.mark.parametrize("slope", [1.0, -1.0])
def test_the_search_stays_between_the_shortest_and_the_longest_duration(slope: float) -> None:
    shortest = shortest_duration(98.0, 0.0, MOON)
    longest = np.hypot(100.0, 98.0) / 0.5
    costs = Costs(lambda duration: 1000.0 + slope * duration)
    end = shortest if slope > 0.0 else longest
    assert costs.plan(ABOVE, AT_REST) == pytest.approx(end, abs=0.05)
    assert shortest <= min(costs.tried)
    assert max(costs.tried) <= longest


@pytest.mark.parametrize("speed", [-3.0, 2.0])
@pytest.mark.parametrize("least", range(50, 60))  # a pace is 8 s: some durations are near the last
def test_no_duration_is_tried_that_gravity_losses_alone_make_dearer(
    least: float, speed: float
) -> None:
    """Thrust over weight, summed over time, is the time and the gain of speed over gravity."""
    costs = Costs(lambda _: least)
    costs.plan(ABOVE, np.array([0.0, 0.0, speed]))
    dearest = least + (0.5 + speed) / 1.62283
    assert dearest / guidance.PACE < max(costs.tried) <= dearest


def test_the_least_is_found_with_one_cost_for_each_step() -> None:
    costs = Costs(lambda duration: (duration - 77.7) ** 2)
    found = guidance._golden(lambda duration: costs.least_propellant(duration)[1], 60.0, 90.0)
    assert found == pytest.approx(77.7, abs=0.025)
    # Each leaves 0.618 of what was left: 30 s * 0.618^14 = 0.036 s; two begin.
    assert len(costs.tried) == 16


def test_it_is_the_same_on_any_number_of_threads() -> None:
    program = (
        "import numpy as np\n"
        "from mjspace.controllers.landing.descent_limits import Limits, least_propellant\n"
        f"points, cost = least_propellant(30.0, np.array({ABOVE.tolist()}), np.zeros(3), {MOON})\n"
        "print(cost.hex(), points.tobytes().hex())\n"
    )
    said = set()
    threads = {"OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENBLAS_CORETYPE"}
    others = {name: value for name, value in os.environ.items() if name not in threads}
    for blas in (
        {},
        {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "OPENBLAS_CORETYPE": "Haswell"},
    ):
        ran = subprocess.run(
            [sys.executable, "-c", program], env=others | blas, capture_output=True, text=True
        )
        assert ran.returncode == 0, ran.stderr
        said.add(ran.stdout)
    points, cost = least_propellant(30.0, ABOVE, AT_REST, MOON)
    assert said == {f"{cost.hex()} {points.tobytes().hex()}\n"}


@pytest.mark.parametrize("duration", [78.0, 81.0])
def test_a_longer_or_shorter_descent_burns_more(duration: float) -> None:
    points = least_propellant(duration, PLACE, VELOCITY, MOON)[0]
    assert keeps(points, duration, PLACE, VELOCITY, MOON)
    more = propellant(points, duration) - propellant(TABLE_3, 79.346)
    assert 0.004 < more < 0.011  # 0.0056 and 0.0080


def test_moving_a_point_burns_more_or_breaks_a_limit() -> None:
    """At 40 s, where the thrust has room all along but for its least."""
    points, cost = least_propellant(40.0, ABOVE, AT_REST, MOON)
    assert keeps(points, 40.0, ABOVE, AT_REST, MOON)
    assert cost * 162.283 / EXHAUST_SPEED == pytest.approx(propellant(points, 40.0), abs=2e-3)
    free = [(row, axis) for row in (4, 5) for axis in (0, 1)] + [(row, 2) for row in range(2, 8)]
    for row, axis in free:
        for step in (-1.0, 1.0):
            moved = points.copy()
            moved[row, axis] += step
            worse = propellant(moved, 40.0) > propellant(points, 40.0) - 5e-5
            assert worse or not keeps(moved, 40.0, ABOVE, AT_REST, MOON)


def test_a_heavier_vehicle_with_more_thrust_flies_the_same() -> None:
    heavy = replace(MOON, mass=250.0, thrust=(175.0, 675.0))
    assert least_propellant(30.0, ABOVE, AT_REST, heavy)[0] == pytest.approx(
        least_propellant(30.0, ABOVE, AT_REST, MOON)[0], abs=1e-6
    )


def test_four_times_the_gravity_takes_half_the_time() -> None:
    strong = replace(
        MOON, gravity=4.0 * MOON.gravity, thrust=(280.0, 1080.0), descent_speed=2.0 * 0.5
    )
    points, cost = least_propellant(30.0, ABOVE, np.array([-2.0, 1.0, -3.0]), MOON)
    faster, less = least_propellant(15.0, ABOVE, np.array([-4.0, 2.0, -6.0]), strong)
    assert faster == pytest.approx(points, abs=1e-6)
    assert less == pytest.approx(0.5 * cost)


def test_a_start_elsewhere_around_the_site_turns_the_plan_with_it() -> None:
    c, s = np.cos(2.0), np.sin(2.0)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    velocity = np.array([-2.0, 1.0, -3.0])
    points = least_propellant(30.0, ABOVE, velocity, MOON)[0]
    turned = least_propellant(30.0, turn @ ABOVE, turn @ velocity, MOON)[0]
    assert turned == pytest.approx(points @ turn.T, abs=1e-3)


def test_the_shortest_duration_is_that_of_a_drop_and_a_stop() -> None:
    """The speed between the two, from the duration, gives the height back."""
    drop, brake = 1.62283 - 0.7 * np.cos(np.radians(45.0)), 2.7 - 1.62283
    # Dropping to the speed p takes p^2 / 2 drop, braking to w takes (p^2 - w^2) / 2 brake.
    for height, speed in ((98.0, 0.0), (98.0, 5.0), (98.0, -5.0)):
        duration = shortest_duration(height, speed, MOON)
        peak = (duration + 0.5 / brake + speed / drop) / (1.0 / drop + 1.0 / brake)
        way = (peak**2 - speed**2) / (2.0 * drop) + (peak**2 - 0.25) / (2.0 * brake)
        assert way == pytest.approx(height)
    assert shortest_duration(0.0, 0.5, MOON) == 0.0
    # Braked from the start: full thrust down to the last speed.
    assert shortest_duration(98.0, 14.58, MOON) == pytest.approx(14.08 / brake)
    # 14.59 m/s can be braked in 98 and a metre more, 14.61 cannot: 14.605^2 = 2 brake 99 + 0.25.
    assert np.isfinite(shortest_duration(98.0, 14.60, MOON))
    assert shortest_duration(98.0, 14.62, MOON) == np.inf
    assert shortest_duration(98.0, 1.0, replace(MOON, thrust=(70.0, 160.0))) == np.inf


@pytest.mark.parametrize(
    ("looser", "tighter"),
    [
        ({"thrust": (70.2, 270.0)}, {"thrust": (70.3, 270.0)}),
        ({"thrust": (70.0, 269.8)}, {"thrust": (70.0, 269.7)}),
        ({"tilt": np.radians(44.95)}, {"tilt": np.radians(44.85)}),
        ({"glide_slope": 0.37}, {"glide_slope": 0.41}),
        ({"clearance": 2.0005}, {"clearance": 2.002}),
        ({"descent_speed": 0.5005}, {"descent_speed": 0.502}),
    ],
)
def test_each_limit_is_minded(looser: dict[str, object], tighter: dict[str, object]) -> None:
    points = np.array(TABLE_3)
    assert keeps(points, 79.346, PLACE, VELOCITY, replace(MOON, **looser))
    assert not keeps(points, 79.346, PLACE, VELOCITY, replace(MOON, **tighter))


@pytest.mark.parametrize("row", [0, 1, 2, 3, 6, 7, 8, 9])
@pytest.mark.parametrize("axis", [0, 1])
def test_each_end_is_minded(row: int, axis: int) -> None:
    points = np.array(TABLE_3)
    points[row, axis] += 0.4 if row in (0, 1, 8, 9) else 10.0
    assert not keeps(points, 79.346, PLACE, VELOCITY, MOON)


@pytest.mark.parametrize("duration", [-79.346, 0.0, np.inf, np.nan])
def test_a_duration_is_positive_and_finite(duration: float) -> None:
    assert not keeps(np.array(TABLE_3), duration, PLACE, VELOCITY, MOON)
