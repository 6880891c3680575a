"""The report: one HTML file that needs nothing else, Markdown with figures, a table that fits."""

import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from mjspace.validation import figures, report, table
from mjspace.validation.benchmark import Bound
from mjspace.validation.benchmarks import ALL
from mjspace.validation.results import Injected, Line, Results, Row, Section

TIME = [0.0, 1.0, 2.0]
SECTION = Section(
    name="spin",
    title="Spin & <tumble>",
    shows="That a | pipe is no column.",
    source="nobody",
    step=0.01,
    rows=[
        Row.judged(Bound("angle | of it", "rad", 1e-9, "as a | b"), 2e-12, {"Euler": 0.02}),
        Row.judged(Bound("period", "s", 3e-8, "digits", target=16.08), 16.0800002),
        Row.judged(Bound("lost", "rad", 1.0, "finite"), np.nan),
    ],
    faults=[
        Injected(fault="inertia", meaning="off", wanted=True, broken=["period"]),
        Injected(fault="held", meaning="held", wanted=False, broken=[]),
        Injected(fault="sign", meaning="the other way", wanted=True, broken=[]),
    ],
    x_label="time [s]",
    y_label="rate [rad/s]",
    motion=[
        Line(label="w1", x=TIME, y=[0.0, 1.0, 0.0]),
        Line(label="w1, MuJoCo", x=TIME, y=[0.0, 1.0, 0.0], dots=True),
    ],
    error_label="error [rad]",
    errors={"RK4": Line(label="e", x=TIME, y=[0.0, 1e-13, 1e-12])},
)
RESULTS = Results(
    versions={"mujoco": "4.0.0"}, quick=False, sections=[SECTION], remarks=["Not <compared>."]
)


class Outline(HTMLParser):
    """Collects a page's text and the tags that would fetch something."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.text: list[str] = []
        self.fetched: list[tuple[str, str | None]] = []
        self.open: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in ("meta", "path", "use", "br"):
            self.open.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "xlink:href") and not (value or "").startswith("#"):
                self.fetched.append((tag, value))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if self.open and self.open[-1] == tag:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        if tag in self.open:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def test_the_page_stands_alone_and_says_everything(tmp_path: Path) -> None:
    data, page = report.write(RESULTS, tmp_path / "new")
    outline = Outline(page.read_text())
    text = " ".join(" ".join(outline.text).split())
    assert outline.fetched == []
    assert outline.open == []
    for said in (
        "Validation: FAIL",
        "Spin & <tumble>",
        "2e-12",
        "1e-09 rad",
        "16.0800002",
        "16.08 ± 3e-08 s",
        "Not <compared>.",
        "mujoco 4.0.0",
        "MISSED",
        "caught",
    ):
        assert said in text, said
    assert Results.model_validate_json(data.read_text()).model_dump() is not None


def test_markdown_rows_have_as_many_cells_as_their_head(tmp_path: Path) -> None:
    report.write_markdown(RESULTS, tmp_path / "validation.md")
    lines = (tmp_path / "validation.md").read_text().splitlines()
    tables = [line.replace("\\|", "") for line in lines if line.startswith("|")]
    assert len(tables) == 3 + 3 + 5
    for rows in (tables[:3], tables[3:6], tables[6:]):
        assert len({row.count("|") for row in rows}) == 1
    assert (tmp_path / "validation" / "spin.svg").is_file()
    assert "](validation/spin.svg)" in "\n".join(lines)


def test_the_page_in_docs_is_of_these_benchmarks() -> None:
    docs = Path(__file__).parents[2] / "docs"
    page = (docs / "validation.md").read_text()
    for benchmark in ALL:
        assert f"## {benchmark.title}\n" in page, "run make validation"
        for bound in benchmark.bounds:
            assert bound.reason.replace("|", "\\|") in page, "run make validation"
    drawn = {path.stem for path in (docs / "validation").iterdir()}
    assert drawn == {benchmark.name for benchmark in ALL} | {"basilisk"}


def test_a_figure_is_the_same_every_time_and_well_formed() -> None:
    drawn = figures.svg(SECTION)
    assert drawn == figures.svg(SECTION)
    words = "".join(ET.fromstring(drawn).itertext())
    assert "rate [rad/s]" in words
    assert "error [rad]" in words


def test_the_table_says_what_failed(capsys: pytest.CaptureFixture[str]) -> None:
    table.show(RESULTS)
    lines = capsys.readouterr().out.splitlines()
    (angle,) = (line for line in lines if "angle" in line)
    assert "2e-12" in angle
    assert "0.02" in angle
    assert "PASS" in angle
    assert "as a | b" in angle
    (lost,) = (line for line in lines if "lost" in line)
    assert "FAIL" in lost
    assert any("spin did not notice: the other way" in line for line in lines)
    assert any("Not <compared>." in line for line in lines)
