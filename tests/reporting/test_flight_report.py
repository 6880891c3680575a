"""The report of flights: what is on the page, that nothing of a stranger's runs, and its size."""

import base64
import re
from pathlib import Path
from typing import Any

import chromium
import numpy as np
import pytest
from command_lines import command_line
from html_pages import Page, unpacked

from mjspace.errors import NoRendererError
from mjspace.log.reader import Log
from mjspace.plotting.panels import curves
from mjspace.reporting import pictures
from mjspace.runner import flight_report
from mjspace.runner.run import run
from mjspace.scenario.scenario import Check

EVIL = "</script><script>document.title='caught'</script><img src=x onerror=alert(1)>"
SCENARIO = f"""
base = "detumble-wheels"
duration = 0.5
description = "Half a second of <b>{EVIL}</b>"
source = "Handbook & notes, {EVIL}"

[[events]]
name = "slow {EVIL}"
signal = "truth.rate[0]"
below = "15 deg/s"

[[checks]]
name = "{EVIL}"
signal = "truth.rate[0]"
statistic = "final"
below = "16 deg/s"
requirement = "ADCS-012"

[[checks]]
name = "stops"
signal = "truth.rate"
statistic = "final"
start = 0.1
below = "5 deg/s"
requirement = "<i>ADCS-013</i>"
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("evil")
    (folder / "x.toml").write_text(SCENARIO)
    return run(folder / "x.toml", out=folder).path


@pytest.fixture(scope="module")
def page(log: Path) -> Path:
    output = log.with_name("report.html")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "_rendered", no_renderer)
        assert command_line("report", str(log), "-o", str(output)) == 0
    return output


def no_renderer(*_: Any, **__: Any) -> None:
    raise NoRendererError("no OpenGL here")


def test_the_page_says_what_was_flown_and_what_came_of_it(page: Path) -> None:
    found = Page(page.read_text())
    rate = float(Log(page.with_name("flight.mcap")).read("/truth", ["rate"])["rate"][-1, 0])
    degrees = np.degrees(rate)
    for shown in (
        "Half a second of",
        "Source: Handbook & notes",
        "ADCS-012",
        "<i>ADCS-013</i>",
        "final of truth.rate[0]",
        "< 16 deg/s",
        f"{degrees:.4g} deg/s",
        f"{16.0 - degrees:.4g} deg/s",  # its margin
        "quaternion_feedback:RateDamping",
        "rate_gain",
        "no picture: no OpenGL here",
        "numba",
        "slow ",
    ):
        assert shown in found.text, shown
    assert re.search(r"FAIL .*PASS .*ADCS-012 .*FAIL .*ADCS-013", found.text)


def test_nothing_of_a_stranger_is_an_element_and_nothing_is_loaded(page: Path) -> None:
    text = page.read_text()
    found = Page(text)
    assert EVIL in found.text
    assert "document.title='caught'" not in "".join(found.scripts)
    assert [tag for tag, _ in found.tags if tag in ("img", "b", "i", "iframe")] == []
    assert len(found.scripts) == 4  # charts, marks, uPlot, the page's own
    for tag, attributes in found.tags:
        for key in ("src", "href", "action", "data"):
            address = attributes.get(key) or ""
            assert address.startswith(("data:", "#")) or not address, (tag, address)
        assert not any(key.startswith("on") for key in attributes), (tag, attributes)
    policy = next(a["content"] for _, a in found.tags if a.get("http-equiv"))
    assert policy is not None
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert "unsafe-inline" not in policy.split("style-src")[0]
    assert not re.search(r"url\(|@import", text)
    assert len(text) < 1_000_000


def test_the_plots_are_the_curves_of_the_standard_page(page: Path) -> None:
    drawn = Page(page.read_text()).charts
    expected = curves(Log(page.with_name("flight.mcap")))
    assert [chart["title"] for chart in drawn["charts"]] == [one.panel.title for one in expected]
    for chart, one in zip(drawn["charts"], expected, strict=True):
        lines = [line for line in chart["series"] if not line["desired"]]
        assert len(lines) == one.value.shape[1]
        for number, line in enumerate(lines):
            x, y = (unpacked(drawn["arrays"][line[axis]]) for axis in "xy")
            np.testing.assert_allclose(x, one.time[:, number], rtol=2e-7)
            value = one.value[:, number]
            shown = np.isfinite(y)
            assert shown[1:].all()  # of an axis of powers of ten what is zero at first is not
            np.testing.assert_allclose(y[shown], value[shown], rtol=2e-7, atol=1e-30)
    (rate,) = [chart for chart in drawn["charts"] if chart["title"] == "Body rate"]
    (bound,) = rate["bounds"]
    assert bound["text"] == "final < 16"
    assert bound["color"] == 0


@pytest.mark.parametrize(
    ("signal", "unit", "scale"),
    [
        ("truth.wheel_speed[0]", "rpm", 30.0 / np.pi),
        ("truth.attitude_error", "deg", 180.0 / np.pi),
        ("truth.momentum", "N m s", 1.0),
        ("law.error", "", 1.0),
        ("truth.nothing", "", 1.0),
    ],
)
def test_a_number_is_in_the_unit_that_a_person_reads(
    log: Path, signal: str, unit: str, scale: float
) -> None:
    check = Check(name="x", signal=signal, below=1.0)
    found, factor = flight_report._unit(Log(log), check)
    assert found == unit
    assert factor == pytest.approx(scale)
    ratio = Check(name="x", signal=signal, below=1.0, target=2.0, relative=True)
    assert flight_report._unit(Log(log), ratio) == ("", 1.0)


@chromium.needed
@pytest.mark.parametrize("width", [1280, 390])
def test_a_browser_draws_every_plot_without_an_error(
    page: Path, tmp_path: Path, width: int
) -> None:
    dom, console = chromium.opened(page, tmp_path, width=width)
    assert console == []
    found = Page(dom)
    expected = len(found.charts["charts"])
    assert [a["data-charts"] for tag, a in found.tags if tag == "html"] == [str(expected)]
    assert sum(tag == "canvas" for tag, _ in found.tags) == expected
    assert "caught" not in dom[dom.index("<title>") : dom.index("</title>")]


def test_two_logs_are_compared(log: Path, tmp_path: Path) -> None:
    other = run(log.with_name("x.toml"), overrides=["law.rate_gain=30"], out=tmp_path / "fast")
    output = tmp_path / "both.html"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "_rendered", no_renderer)
        flight_report.write([log, other.path], output)
    found = Page(output.read_text())
    assert "fast" in found.text
    stops = found.text[found.text.index("ADCS-013") :]
    assert stops.index("FAIL") < stops.index("PASS")  # side by side, the first log first
    (rate,) = [c for c in found.charts["charts"] if c["title"] == "Body rate"]
    names = [line["name"] for line in rate["series"] if not line["desired"]]
    assert [name.rpartition(" ")[2] for name in names] == [log.parent.name] * 3 + ["fast"] * 3
    assert {line["dash"] for line in rate["series"] if not line["desired"]} == {0, 1}


def test_a_run_writes_its_report_with_a_still(tmp_path: Path) -> None:
    short = ("--set", "duration=0.05", "--out", str(tmp_path), "--report", "--json")
    assert command_line("run", "detumble-wheels", *short) == 1  # it has not stopped by then
    found = Page((tmp_path / "flight.html").read_text())
    sources = [a["src"] or "" for tag, a in found.tags if tag == "img"]
    if sources:
        content = base64.b64decode(sources[0].removeprefix("data:image/webp;base64,"))
        assert content[8:12] == b"WEBP"
    else:
        assert "no picture: " in found.text


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("-o", "x.pdf"), "end it in .html"),
        (("-o", "x.html", "--signal", "truth.rat"), "rate"),
    ],
)
def test_what_cannot_be_written_is_one_line(
    log: Path, words: tuple[str, ...], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command_line("report", str(log), *words) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


def test_too_many_logs_are_refused(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line("report", *[str(log)] * 7, "-o", "x.html") == 2
    assert "7 logs: should be from 1 to 6" in capsys.readouterr().err
