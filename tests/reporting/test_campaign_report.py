"""The report of a campaign: its answer, histograms, correlations, links to the worst logs."""

import json
from pathlib import Path
from urllib.parse import unquote

import chromium
import numpy as np
import pytest
from command_lines import command_line
from html_pages import Page, unpacked

from mjspace.campaign.campaign import fly
from mjspace.campaign.members import Campaign
from mjspace.campaign.report import answer
from mjspace.campaign.results import results_in

EVIL = "<img src=x onerror=alert(1)></script>"
SCENARIO = f"""
base = "detumble-wheels"
description = "A tenth of a second of the tumble, dispersed"
duration = 0.1

[[checks]]
name = "rate at first {EVIL}"
signal = "truth.rate[0]"
statistic = "max"
below = 0.31
requirement = "ADCS-007"

[[dispersions]]
key = "initial.rate[0]"
distribution = "normal"
std = "1 deg/s"

[[dispersions]]
key = "initial.rate[1]"
distribution = "discrete"
values = [0.1, 0.2]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a campaign of 30 members, most of which succeed."""
    home = tmp_path_factory.mktemp("campaign")
    (home / "spin.toml").write_text(SCENARIO)
    out = home / "a folder"
    fly(Campaign(str(home / "spin.toml"), (), 30, seed=3), out, processes=1)
    (home / "spin.toml").unlink()  # the folder is enough
    return out


@pytest.fixture(scope="module")
def page(folder: Path) -> Path:
    output = folder.parent / "pages" / "report.html"
    output.parent.mkdir()
    assert command_line("report", str(folder), "-o", str(output)) == 0
    return output


def test_the_answer_of_the_folder_is_on_the_page(page: Path, folder: Path) -> None:
    text = page.read_text()
    shown = Page(text)
    results = results_in(folder)
    found = answer(results, None)
    assert 0 < found.rate.successes < 30
    low, high = found.interval
    assert f"{found.rate.successes} of 30 members succeed" in shown.text
    assert f"interval {100 * low:.4g} to {100 * high:.4g} %" in shown.text
    for word in ("ADCS-007", EVIL, "initial.rate[0]", "values 0.1, 0.2", "seed 3", "mujoco"):
        assert word in shown.text, word
    assert f"left: {100 * low:.3f}%; right: {100 - 100 * high:.3f}%" in text
    correlation = found.checks[0].correlations["initial.rate[0]"]
    assert correlation is not None
    assert correlation < -0.9  # of a rate that falls, the largest is the first
    assert f"{correlation:+.2f}" in shown.text
    assert f"width: {-50 * correlation:.2f}%" in text
    assert [tag for tag, _ in shown.tags if tag == "img"] == []


def test_the_worst_are_linked_from_where_the_page_is(page: Path, folder: Path) -> None:
    links = [a["href"] or "" for tag, a in Page(page.read_text()).tags if tag == "a"]
    logs = [(page.parent / unquote(link)).resolve() for link in links]
    found = answer(results_in(folder), None)
    assert logs == [Path(each.log).resolve() for each in found.worst if each.log]
    assert logs
    assert all(log.is_file() for log in logs)


def test_the_charts_count_every_member(page: Path, folder: Path) -> None:
    drawn = Page(page.read_text()).charts
    scatter, histogram = drawn["charts"]
    results = results_in(folder)
    passed = results.column("passed") > 0.5
    assert (scatter["x"], scatter["y"]) == ("initial.rate[0]", "initial.rate[1]")
    for line, right in zip(scatter["series"], (passed, ~passed), strict=True):
        x, y = (unpacked(drawn["arrays"][line[axis]]) for axis in "xy")
        members = np.argsort(results.column("initial.rate[0]")[right])
        for values, draw in ((x, "initial.rate[0]"), (y, "initial.rate[1]")):
            np.testing.assert_allclose(values, results.column(draw)[right][members], rtol=1e-6)
    (bars,) = histogram["series"]
    assert unpacked(drawn["arrays"][bars["y"]]).sum() == 30
    assert histogram["bounds"] == [
        {"text": "< 0.31", "from": [0.31, 0.0], "to": [0.31, None], "color": None}
    ]


@chromium.needed
def test_a_browser_draws_it_without_an_error(page: Path, tmp_path: Path) -> None:
    dom, console = chromium.opened(page, tmp_path)
    assert console == []
    assert [a["data-charts"] for tag, a in Page(dom).tags if tag == "html"] == ["2"]


def test_the_campaign_itself_writes_it(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spin = folder.parent / "spin.toml"
    spin.write_text(SCENARIO)
    words = ("campaign", str(spin), "--n", "30", "--seed", "3", "--out", str(folder))
    status = command_line(*words, "--gate", "success >= 0.999", "--report", "--json")
    assert status == 1
    path = Path(json.loads(capsys.readouterr().out)["report"])
    assert "gate success >= 0.999 @ 0.95 FAIL" in " ".join(Page(path.read_text()).text.split())


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "Is a directory"),
        ("[]", "is no description of a campaign"),
        ("{", "campaign.json"),
        (json.dumps({"scenario": "duration = 'long'"}), "campaign.json"),
        (json.dumps({"scenario": 3}), "campaign.json"),
    ],
)
def test_a_folder_that_is_none_is_one_line(
    content: str | None, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if content is not None:
        (tmp_path / "campaign.json").write_text(content)
    assert command_line("report", str(tmp_path), "-o", str(tmp_path / "x.html")) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1
    assert not (tmp_path / "x.html").exists()


def test_a_folder_stands_alone(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command_line("report", str(folder), str(folder), "-o", str(tmp_path / "x.html")) == 2
    assert "mjspace compare" in capsys.readouterr().err
