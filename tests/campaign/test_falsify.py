"""Falsification: planted weaknesses found, made minimal, and written as a scenario and a log."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_lines import command_line
from one_axis import ONE_AXIS, written

from mjspace.campaign import robustness
from mjspace.campaign.falsify import Falsified, falsify, nominal_draws
from mjspace.campaign.members import Campaign, population
from mjspace.campaign.search import minimize
from mjspace.errors import InputError
from mjspace.log.reader import Log
from mjspace.runner.checks import Verdict
from mjspace.runner.run import run
from mjspace.scenario.scenario import Check

SCENARIO = (
    ONE_AXIS.replace("checks = []", "")
    + """
[[checks]]
name = "rate"
signal = "truth.rate"
start = "5 s"
below = 0.01

[[dispersions]]
key = "law.rate_gain"
distribution = "uniform"
low = 2
high = 30

[[dispersions]]
key = "plant.gyrostat_inertia[0][0]"
distribution = "uniform"
low = 6
high = 14

[[dispersions]]
key = "initial.rate[1]"
distribution = "normal"
std = 1e-4
"""
)
UNSTABLE = 2.0 / 0.5
"""Gain over inertia from which on it is: w[k + 1] = (1 - T gain / inertia) w[k]."""


def searched(what: Campaign, **options: Any) -> Falsified:
    return falsify(population(what), **options)


@pytest.mark.usefixtures("here")
def test_the_weakness_is_found_and_made_minimal(tmp_path: Path) -> None:
    found = searched(Campaign(written(tmp_path, SCENARIO), (), 200, 1))
    assert found.worst.margin < 0.0
    assert 0 < found.before <= found.flights <= 200
    gain, inertia, rate = found.worst.draws
    assert gain / (inertia - 0.05) > UNSTABLE
    assert found.minimal is not None
    gain, inertia, rate = found.minimal.draws
    assert rate == 0.0
    # Each is halved six times on its way from the scenario's 6 and 10.
    assert UNSTABLE < gain / (inertia - 0.05) < 1.05 * UNSTABLE


@pytest.mark.usefixtures("here")
def test_a_formula_that_is_violated_in_a_corner_is_found(tmp_path: Path) -> None:
    pytest.importorskip("rtamt")
    # A second after 0.01 rad/s there is (1 - T gain / inertia)^2 of it: over 0.004 with gains
    # below 0.37 inertia / T, and beyond 1.63 of it, which this range does not reach.
    formula = """formula = "always(begins > 0.3 deg/s -> eventually[1:1 s](rate < 0.004 rad/s))"
signals = { begins = "truth.rate", rate = "truth.rate" }
"""
    text = SCENARIO.replace('signal = "truth.rate"\nstart = "5 s"\nbelow = 0.01\n', formula)
    text = text.replace("low = 2\nhigh = 30", "low = 5\nhigh = 25")
    what = Campaign(written(tmp_path, text), ("law.rate_gain=15",), 100, 1)
    found = searched(what)
    assert found.worst.margin < 0.0
    gain, inertia, _ = found.worst.draws
    left = (1.0 - 0.5 * gain / inertia) ** 2
    assert found.worst.margin == pytest.approx(1.0 - 0.01 * left / 0.004, abs=0.05)
    assert found.worst.why.startswith("FAIL rate: -")


@pytest.mark.usefixtures("here")
def test_where_nothing_fails_the_least_margin_is_told(tmp_path: Path) -> None:
    safe = SCENARIO.replace("high = 30", "high = 20")
    found = searched(Campaign(written(tmp_path, safe), (), 30, 1))
    assert found.minimal is None
    assert (found.before, found.flights) == (0, 31)  # the first is the scenario as it is
    assert 0.0 < found.worst.margin < 1.0
    assert "rate" in found.worst.why


@pytest.mark.usefixtures("here")
def test_the_same_seed_finds_the_same_and_a_search_goes_on_if_asked(tmp_path: Path) -> None:
    path = written(tmp_path, SCENARIO)
    once, again = (searched(Campaign(path, (), 20, 7), processes=1) for _ in range(2))
    assert once == again
    longer = searched(Campaign(path, (), 40, 7), go_on=True, processes=1)
    assert longer.before == once.before
    assert longer.worst.margin < once.worst.margin
    assert searched(Campaign(path, (), 20, 8), processes=1).worst.draws != once.worst.draws


def test_a_scenario_that_fails_as_it_is_or_has_no_dispersions_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="fails as it is: FAIL rate"):
        searched(Campaign(written(tmp_path, SCENARIO), ("law.rate_gain=41",), 10, 1), processes=1)
    with pytest.raises(InputError, match="no checks"):
        searched(Campaign(written(tmp_path, SCENARIO), ("checks=[]",), 10, 1))
    with pytest.raises(InputError, match="there is nothing to search"):
        searched(Campaign("wheel-failure", (), 10, 1))


def test_a_scenario_without_a_value_of_its_own_starts_from_the_median(tmp_path: Path) -> None:
    text = SCENARIO.replace('key = "initial.rate[1]"', 'key = "plant.wheels.torque_limit"')
    text = text.replace('"normal"\nstd = 1e-4', '"uniform"\nlow = 1\nhigh = 4')
    own = nominal_draws(population(Campaign(written(tmp_path, text), (), 1, 1)))
    assert own == pytest.approx([6.0, 10.0, 2.5])


def test_robustness_is_the_least_margin_over_the_size_of_its_bound() -> None:
    below = Verdict(Check(name="a", signal="truth.rate", below=2.0), 1.5)
    band = Verdict(Check(name="b", signal="truth.rate", above=1.0, below=3.0), 2.9)
    fails = Check(name="c", signal="truth.rate", above=4.0, expected="FAIL", because="x")
    assert robustness.of_flight([below], "") == pytest.approx(0.25)
    assert robustness.of_flight([below, band], "") == pytest.approx(0.1)
    assert robustness.of_flight([below, Verdict(fails, 3.0)], "") == pytest.approx(0.25)
    assert robustness.of_flight([below, Verdict(fails, 5.0)], "") == pytest.approx(-0.25)
    assert robustness.of_flight([below], "it ended early") == -np.inf


def test_a_search_keeps_to_its_budget_and_its_box() -> None:
    points = [p for p, _ in minimize(lambda x: np.sum((x - 0.7) ** 2, axis=1), 2, 100, 3)]
    every = np.concatenate(points)
    assert every.shape == (100, 2)
    assert ((every >= 0.0) & (every <= 1.0)).all()


def test_a_patient_search_converges() -> None:
    found = minimize(lambda x: np.sum((x - 0.7) ** 2, axis=1), 2, 400, 3, patience=None)
    assert min(float(values.min()) for _, values in found) < 1e-12


@pytest.mark.parametrize(
    ("margin", "width", "share"),
    [
        # A product of four that only a corner meets; a ball that is narrow, or beside a valley.
        (lambda x: 1.0 - x.prod(axis=1) / 0.7, 4, 0.1),
        (lambda x: np.linalg.norm(x - [0.85, 0.2, 0.6], axis=1) / 0.06 - 1.0, 3, 0.1),
        (
            lambda x: np.minimum(
                np.linalg.norm(x - 0.25, axis=1) / 0.2 + 0.05,
                np.linalg.norm(x - 0.8, axis=1) / 0.2 - 1.0,
            ),
            5,
            0.2,
        ),
    ],
)
def test_what_fails_is_found_with_a_fraction_of_the_points_that_chance_needs(
    margin: Callable[[Any], Any], width: int, share: float
) -> None:
    rng = np.random.default_rng(0)
    probability = float(np.mean(margin(rng.random((1_000_000, width))) < 0.0))
    by_chance = np.log(0.5) / np.log(1.0 - probability)  # the median

    def needed(seed: int) -> int:
        count = 0
        for _, values in minimize(margin, width, 2000, seed):
            if (values < 0.0).any():
                return count + int(np.argmax(values < 0.0)) + 1
            count += len(values)
        return count

    assert np.median([needed(seed) for seed in range(20)]) < share * by_chance


@pytest.mark.slow
def test_the_counterexample_is_a_scenario_and_a_log_of_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its law comes from a file beside the scenario, which goes with it."""
    (tmp_path / "own.py").write_text(
        "from mjspace.controllers.attitude.quaternion_feedback import RateDamping\n\n\n"
        "class Own(RateDamping):\n    pass\n"
    )
    law = '[law]\nkind = "own.py:Own"\nrate_gain = 6\n\n[initial]'
    path = written(tmp_path, SCENARIO.replace("[initial]", law))
    out = tmp_path / "out"
    words = ["falsify", path, "--n", "60", "--seed", "1", "--out", str(out), "--workers", "2"]
    assert command_line(*words, "--json") == 1
    found = json.loads(capsys.readouterr().out)
    assert found["failed"]
    assert found["draws"]["initial.rate[1]"]["minimal"] == 0.0
    again = run(str(out / "scenario.toml"), out=tmp_path / "again")
    assert not again.passed
    one, two = Log(out / "flight.mcap"), again.log
    assert np.array_equal(one.read("/state")["physics"], two.read("/state")["physics"])
    assert command_line(*words) == 2  # nothing is overwritten
    assert "there already" in capsys.readouterr().err
