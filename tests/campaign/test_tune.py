"""Tuning against gains that are known to be best."""

import json
from pathlib import Path

import pytest
from command_lines import command_line
from one_axis import ONE_AXIS, written

from mjspace.campaign.members import Campaign
from mjspace.campaign.tune import Goal, Varied, tune, varied
from mjspace.errors import InputError
from mjspace.scenario.loading import load

INERTIA = """
[[dispersions]]
key = "plant.gyrostat_inertia[0][0]"
distribution = "uniform"
low = 8
high = 12
"""
DEADBEAT = (10.0 - 0.05) / 0.5
"""w[k + 1] = (1 - T gain / inertia) w[k] is at rest after one period."""
GAIN = [Varied("law.rate_gain", 1.0, 100.0)]
GOAL = Goal("rms(truth.rate)", ())


@pytest.mark.usefixtures("here")
def test_the_best_gain_of_one_flight_is_that_of_the_closed_form(tmp_path: Path) -> None:
    found = tune(Campaign(written(tmp_path), (), 40, 1), GAIN, GOAL, draws=4, fresh=5)
    assert found.values["law.rate_gain"] == pytest.approx(DEADBEAT, rel=0.02)
    assert found.own == {"law.rate_gain": 6}
    # Only the first of 21 samples is left of the rate.
    assert found.after.mean == pytest.approx(0.01 / 21**0.5, rel=1e-3)
    assert found.before.mean > 1.3 * found.after.mean
    assert (found.better, found.after.missed) == (1, 0)
    assert found.flights == 1 + 40 + 2  # alone, since without dispersions all draws are alike


@pytest.mark.usefixtures("here")
def test_a_requirement_bounds_the_gain(tmp_path: Path) -> None:
    goal = Goal("rms(truth.rate)", ("peak(command.torque) < 0.1 N m",))
    found = tune(Campaign(written(tmp_path), (), 40, 1), GAIN, goal, draws=1, fresh=1)
    assert 9.4 < found.values["law.rate_gain"] <= 10.0
    hard = Goal("rms(truth.rate)", ("peak(command.torque) < 0.05 N m",))
    assert tune(Campaign(written(tmp_path), (), 20, 1), GAIN, hard, draws=1, fresh=1).before.missed


@pytest.mark.usefixtures("here")
def test_several_draws_are_tuned_on_and_others_compared(tmp_path: Path) -> None:
    path = written(tmp_path, ONE_AXIS + INERTIA)
    found = tune(Campaign(path, (), 30, 1), GAIN, GOAL, draws=3, fresh=6)
    assert 8.0 / 0.5 < found.values["law.rate_gain"] < 12.0 / 0.5
    assert found.better == 6
    assert found.after.largest < found.before.mean
    assert found.flights == 1 + 3 * 30 + 2 * 6


def test_bounds_are_in_si_and_their_logarithm_is_covered() -> None:
    found = varied("initial.rate[0] = 1 deg/s .. 0.5")
    assert (found.key, found.path) == ("initial.rate[0]", ("initial", "rate", "0"))
    assert (found.low, found.high) == pytest.approx((0.017453292519943295, 0.5))
    assert varied("law.rate_gain=1..100").at(0.5) == pytest.approx(10.0)
    assert varied("law.rate_gain=-1..100").at(0.5) == pytest.approx(49.5)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--vary", "law.rate_gain"], "should be as 'law.rate_gain=1..100'"),
        (["--vary", "law.rate_gain=5..2"], "5 should be less than 2"),
        (["--vary", "law.rate_gan=1..2"], "did you mean 'rate_gain'"),
        (["--vary", "checks=1..2"], "is no part of the flight"),
        (["--vary", "plant.gyrostat_inertia[0][0]=1..2"], "it is dispersed"),
        (["--vary", "law.rate_gain=1..2", "--minimize", "rms(rate)"], "rate"),
        (["--vary", "law.rate_gain=1..2", "--vary", "law.rate_gain=3..4"], "is given twice"),
        (["--vary", "law.rate_gain=1 m..2 m"], "should be N m s/rad"),
        (["--vary", "law.rate_gain=1 m..2 s"], "both bounds should be of one dimension"),
        (["--vary", "initial.rate=1..2"], "initial.rate is [0.01, 0.0, 0.0], should be a number"),
        (["--vary", "law.rate_gain=1..2", "--minimize", "truth.rate"], "should be as 'rms("),
    ],
)
def test_bad_input_is_one_line(
    options: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = written(tmp_path, ONE_AXIS + INERTIA), tmp_path / "out"
    asked = [] if "--minimize" in options else ["--minimize", "rms(truth.rate)"]
    assert command_line("tune", path, *asked, *options, "--out", str(out)) == 2
    shown = capsys.readouterr()
    assert not shown.out
    assert says in shown.err.splitlines()[-1]
    assert not out.exists()


def test_a_value_that_is_dispersed_too_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, ONE_AXIS + INERTIA)
    what = [Varied("plant.gyrostat_inertia[0][0]", 1.0, 2.0)]
    with pytest.raises(InputError, match="it is dispersed"):
        tune(Campaign(path, (), 3, 1), what, GOAL, draws=1, fresh=1)


@pytest.mark.usefixtures("here")
def test_a_scenario_without_dispersions_has_a_folder_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    options = ["--vary", "law.rate_gain=5..6", "--minimize", "rms(truth.rate)", "--n", "1"]
    assert command_line("tune", written(tmp_path), *options) == 0
    assert load(tmp_path / "runs" / "one_axis" / "tuned" / "scenario.toml")


@pytest.mark.slow
def test_the_tuned_scenario_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = written(tmp_path, ONE_AXIS + INERTIA), tmp_path / "out"
    words = ["tune", path, "--vary", "law.rate_gain=1..100", "--minimize", "rms(truth.rate)"]
    words += ["--n", "8", "--draws", "2", "--fresh", "2", "--seed", "1", "--out", str(out)]
    assert command_line(*words, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    tuned, _ = load(out / "scenario.toml")
    assert tuned.law.gains["rate_gain"] == found["values"]["law.rate_gain"]
    assert tuned.dispersions[0].key == "plant.gyrostat_inertia[0][0]"
    assert tuned.seed == 1
    assert command_line(*words) == 2
    assert "is there already" in capsys.readouterr().err
