"""Metrics of a campaign's members: columns, figures, comparisons, and an objective of tuning."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from command_lines import command_line
from one_axis import ONE_AXIS, written

from mjspace.campaign import campaign as campaigns
from mjspace.campaign import html_report, report
from mjspace.campaign.members import Campaign
from mjspace.campaign.pairs import compare
from mjspace.campaign.results import results_in
from mjspace.campaign.tune import Goal, Varied, tune
from mjspace.errors import InputError

SCENARIO = (
    ONE_AXIS.replace("10 s", "3 s")
    + """
[[metrics]]
name = "second"
function = "mine.py:second"
signals = ["truth.rate[0]"]

[[metrics]]
name = "rms"
signal = "truth.rate"
statistic = "rms"

[[dispersions]]
key = "initial.rate[0]"
distribution = "uniform"
low = 0.01
high = 0.03
"""
)
Capsys = pytest.CaptureFixture[str]
MINE = """
def second(time, signals):
    rate = signals["truth.rate[0]"]
    if rate[0] > 0.02:
        raise OverflowError("too fast")
    return rate[1]
"""
LEFT = 1.0 - 0.5 * 6.0 / 10.0
"""Of the rate, after a period: w[k + 1] = (1 - T gain / inertia) w[k], the wheel turning along."""


@pytest.fixture
def path(tmp_path: Path) -> str:
    (tmp_path / "mine.py").write_text(MINE)
    return written(tmp_path, SCENARIO)


@pytest.mark.usefixtures("here")
def test_metrics_are_columns_and_the_answer_has_their_figures(path: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    flight = campaigns.fly(Campaign(path, (), 8, 1), out)
    table = flight.store.read()
    rates, second = (np.array(table[name]) for name in ("initial.rate[0]", "second: value"))
    slow = rates <= 0.02
    assert 0 < slow.sum() < 8
    assert second[slow].astype(float) == pytest.approx(LEFT * rates[slow], rel=1e-6)
    assert [told is None for told in table["second: missing"].to_pylist()] == slow.tolist()
    assert [value is not None for value in table["second: value"].to_pylist()] == slow.tolist()
    assert table["second: missing"][int(np.argmin(slow))].as_py() == (
        "second() raised OverflowError at mine.py:5: too fast"
    )
    found = report.answer(flight.store, None)
    mine, rms = found.metrics
    assert (mine.name, mine.missing, rms.missing) == ("second", 8 - slow.sum(), 0)
    assert "too fast" in mine.why
    assert mine.correlations == {"initial.rate[0]": pytest.approx(1.0)}
    assert rms.values is not None
    k = np.arange(7)
    scale = np.sqrt(np.mean(LEFT ** (2 * k)))
    assert rms.values.median == pytest.approx(np.median(rates) * scale, rel=1e-6)
    assert report.data(found)["metrics"][0] == dataclasses.asdict(mine)
    page = tmp_path / "report.html"
    html_report.write(results_in(out), found, page)
    assert "rms of truth.rate" in page.read_text()
    # Another function is another campaign.
    (tmp_path / "mine.py").write_text(MINE + "\n")
    with pytest.raises(InputError, match=r"other sources: metrics.py"):
        campaigns.fly(Campaign(path, (), 9, 1), out)


@pytest.mark.usefixtures("here")
def test_two_campaigns_are_compared_by_their_metrics(path: str, tmp_path: Path) -> None:
    for name, overrides in (("one", ()), ("two", ("law.rate_gain=4",))):
        campaigns.fly(Campaign(path, overrides, 8, 1), tmp_path / name)
    second, rms = compare(tmp_path / "one", tmp_path / "two").metrics
    assert (rms.name, rms.members, rms.larger) == ("rms", 8, 1.0)
    assert 0.0 < rms.interval[0] <= rms.difference <= rms.interval[1]
    assert second.members < 8


@pytest.mark.usefixtures("here")
def test_a_metric_is_minimized(path: str) -> None:
    gain = [Varied("law.rate_gain", 1.0, 30.0)]
    goal = Goal("rms", ("peak(command.torque) < 10 N m",))
    found = tune(Campaign(path, (), 16, 1), gain, goal, draws=1, fresh=2)
    # At rest after one period.
    assert found.values["law.rate_gain"] == pytest.approx((10.0 - 0.05) / 0.5, rel=0.2)
    assert found.better == 2


def test_the_command_lines_take_them(path: str, tmp_path: Path, capsys: Capsys) -> None:
    assert command_line("run", path, "--out", str(tmp_path / "run")) == 0
    assert "second" in capsys.readouterr().out
    assert command_line("tune", path, "--vary", "law.rate_gain=1..9", "--minimize", "x") == 2
    assert "--minimize 'x': no metric of that name: have " in capsys.readouterr().err
