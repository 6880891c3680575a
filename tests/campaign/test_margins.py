"""Margins against those that a sampled integrator has in closed form."""

import json
import math
from pathlib import Path

import pytest
from command_lines import command_line
from one_axis import ONE_AXIS, written

from mjspace.campaign.margins import Margin, Question, Trial, find
from mjspace.campaign.requirement import objective, requirement
from mjspace.errors import InputError

SCENARIO = ONE_AXIS.replace("10 s", "300 s")
STABLE = "max(truth.rate) < 0.01 rad/s from 250 s"
FED_BACK = 0.5 * 6.0 / (10.0 - 0.05)
"""a of w[k + 1] = w[k] - a w[k - d]: period times gain over the inertia of the bus about x."""


@pytest.fixture
def scenario(tmp_path: Path) -> str:
    return written(tmp_path, SCENARIO)


def margins(scenario: str, *keys: str, require: str = STABLE) -> dict[str, Margin]:
    found = find(Question(scenario, requirements=(require,)), keys)
    return {margin.key: margin for margin in found}


def bounds(margin: Margin) -> tuple[float, float]:
    assert margin.survived is not None
    assert margin.failed is not None
    return margin.survived, margin.failed.value


@pytest.mark.usefixtures("here")
def test_the_delay_that_is_survived_is_that_of_the_closed_form(scenario: str) -> None:
    """The integrator is stable for a < 2 sin(pi / (2 (2 d + 1))): Levin and May 1976."""
    most = 0
    while 2.0 * math.sin(math.pi / (2.0 * (2.0 * (most + 1) + 1.0))) > FED_BACK:
        most += 1
    assert most == 4
    found = margins(scenario, "delay")["delay"]
    assert bounds(found) == pytest.approx((0.5 * most, 0.5 * (most + 1)), rel=1e-12)


def settled_behind_a_lag(time_constant: float) -> bool:
    """Tell of the integrator's recurrence whether its rate is below 0.001 rad/s from 250 s on."""
    left = math.exp(-0.5 / time_constant)
    rate, applied, late = 0.01, 0.0, []
    for k in range(601):
        if k >= 500:
            late.append(abs(rate))
        applied = rate + left * (applied - rate)
        rate -= FED_BACK * applied
    return max(late) < 0.001


@pytest.mark.usefixtures("here")
def test_the_lag_that_is_survived_is_that_of_the_recurrence(scenario: str) -> None:
    """No lag makes it unstable: its oscillation decays as e^(-t / 2 T), too slowly at last."""
    require = "max(truth.rate) < 0.001 rad/s from 250 s"
    low, high = bounds(margins(scenario, "lag", require=require)["lag"])
    assert low < high < 1.06 * low
    assert settled_behind_a_lag(low)
    assert not settled_behind_a_lag(high)


@pytest.mark.usefixtures("here")
def test_gain_and_sampling_are_survived_up_to_the_closed_form(scenario: str) -> None:
    """Without delay the integrator is stable for a < 2, with the gain or the period n-fold."""
    found = margins(scenario, "gain-up", "gain-down", "sampling")
    low, high = bounds(found["gain-up"])
    assert low < 2.0 / FED_BACK < high < 1.06 * low
    whole = math.floor(2.0 / FED_BACK)
    assert bounds(found["sampling"]) == pytest.approx((0.5 * whole, 0.5 * (whole + 1)), rel=1e-12)
    assert found["gain-down"].failed is None
    assert found["gain-down"].survived == pytest.approx(1.0 / 32.0)


@pytest.mark.usefixtures("here")
def test_noise_is_survived_up_to_its_standard_deviation_in_steady_state(scenario: str) -> None:
    """The measured noise s makes the rate's a^2 s^2 / (1 - (1 - a)^2) on each axis."""
    require = "rms(truth.rate[0]) < 0.001 rad/s from 50 s"
    low, high = bounds(margins(scenario, "rate-noise", require=require)["rate-noise"])
    right = 0.001 / math.sqrt(FED_BACK / (2.0 - FED_BACK))
    # 500 samples, correlated over 1 / a = 3 of them: their RMS is known to 10 %, two of its sigmas.
    assert low == pytest.approx(right, rel=0.15)
    assert low < high < 1.06 * low


@pytest.mark.usefixtures("here")
def test_what_the_law_believes_of_the_inertia_is_changed_on_its_side_alone(tmp_path: Path) -> None:
    """It scales the feedback too: more is survived, less than a fifth is not."""
    text = """
base = "contraction-ideal"
description = "The ideal law with a little feedback"
duration = "1 s"
checks = []

[plant]
gyrostat_inertia = [[10, 0, 0], [0, 12, 0], [0, 0, 14]]
"""
    path = tmp_path / "ideal.toml"
    path.write_text(text)
    require = "max(truth.attitude_error) < 1 deg"
    found = margins(str(path), "inertia-up", "inertia-down", require=require)
    assert found["inertia-up"].failed is None
    low, high = bounds(found["inertia-down"])
    assert 0.1 < high < low < 0.3


def test_a_margin_is_between_the_worst_that_went_well_and_the_least_that_did_not() -> None:
    trials = [Trial(1, 1.0, True, ""), Trial(4, 4.0, False, "far"), Trial(2, 2.0, False, "near")]
    margin = Margin("delay", trials)
    assert margin.survived == 1.0
    assert margin.failed == trials[2]
    assert Margin("delay", trials[1:]).survived is None
    assert Margin("delay", trials[:1]).failed is None


def test_requirements_are_checks() -> None:
    check = requirement("peak(truth.wheel_speed[1]) > 100 rpm from 2 s")
    assert check.signal == "truth.wheel_speed[1]"
    assert check.statistic == "peak"
    assert float(check.above or 0.0) == pytest.approx(100.0 * math.pi / 30.0)
    assert check.below is None
    assert check.start == 2.0
    assert objective("rms( truth.attitude_error )", "--minimize") == ("rms", "truth.attitude_error")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("truth.rate < 1", "should be as"),
        ("max(truth.rate) = 1", "should be as"),
        ("maximum(truth.rate) < 1", "no statistic 'maximum'"),
        ("max(truth.rate) < 1 furlong", "furlong"),
        ("max(truth.rate) < 1 from -2 s", "-2"),
    ],
)
def test_a_requirement_that_is_none_is_one_line(text: str, says: str) -> None:
    with pytest.raises(InputError, match=says) as caught:
        requirement(text)
    assert str(caught.value).startswith("--require")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--only", "delays"], "did you mean 'delay'"),
        (["--only", "inertia-up"], "has nothing that it changes"),
        (["--tolerance", "0"], "between 0 and 1"),
        (["--require", "max(truth.rte) < 1"], "truth.rte"),
        (["--require", "final(truth.rate) > 1 rad/s"], "fails as it is"),
        (["-o", "x.jpg"], "end it in .png"),
        (["-o", "missing/x.png"], "there is no folder missing"),
        (["--require", "max(truth.rate) < 1 m"], "checks.0.below: got 1 m for truth.rate"),
        (["--require", "max(truth.rate) < nan"], "should be a finite number"),
        ([], "no checks"),
    ],
)
def test_bad_input_is_one_line(
    scenario: str, options: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = [] if not options or "--require" in options else ["--require", STABLE]
    assert command_line("margins", scenario, *asked, *options) == 2
    out, err = capsys.readouterr()
    assert not out
    assert says in err.splitlines()[-1]


@pytest.mark.slow
def test_the_command_prints_the_margins_and_draws_them(
    scenario: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "margins.png"
    asked = ["margins", scenario, "--require", STABLE, "--only", "delay", "--only", "gain-up"]
    assert command_line(*asked, "--json", "-o", str(picture)) == 0
    delay, gain = json.loads(capsys.readouterr().out)
    assert (delay["survived"], delay["failed"]) == (2.0, 2.5)
    assert gain["trials"][0] == {"step": 0.05, "value": 1.05, "survived": True, "why": ""}
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert command_line(*asked, "--workers", "1") == 0
    out = capsys.readouterr().out
    assert "delay of all actuators" in out
    assert "2.5 s" in out
