"""The report: one HTML file that needs nothing else, Markdown with figures, a table that fits."""

import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from mjspace.validation import basilisk_orbit, figures, report, table
from mjspace.validation.benchmark import Bound
from mjspace.validation.benchmarks import ALL
from mjspace.validation.passport import Finding, Passport
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
        Injected(fault="inertia", meaning="off", expected=True, broken=["period"]),
        Injected(fault="held", meaning="held", expected=False, broken=[]),
        Injected(fault="sign", meaning="the other way", expected=True, broken=[]),
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
    for case in basilisk_orbit.CASES:
        assert f"## {case.title}, against Basilisk" in page, "run make validation"
        for bound in case.bounds:
            assert bound.reason in page, "run make validation"
    drawn = {path.stem for path in (docs / "validation").iterdir()}
    against = {"basilisk", *(case.name for case in basilisk_orbit.CASES)}
    assert drawn == {benchmark.name for benchmark in ALL} | against


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
    assert any("spin did not detect: the other way" in line for line in lines)
    assert any("Not <compared>." in line for line in lines)


def shown(capsys: pytest.CaptureFixture[str], results: Results = RESULTS) -> list[str]:
    table.show(results)
    return capsys.readouterr().out.splitlines()


def cells(lines: list[str], head: str) -> dict[str, dict[str, str]]:
    """Return the rows of the table whose first column is ``head``: by their first cell, by column.

    StateLayout are two blanks apart, and no cell of these has two blanks in it.
    """
    begin = next(k for k, line in enumerate(lines) if line.startswith(head))
    starts = [0, *(m.end() for m in re.finditer("  +", lines[begin].rstrip()))]
    spans = [slice(a, b) for a, b in zip(starts, [*starts[1:], None], strict=True)]
    rows = {}
    for line in lines[begin + 1 :]:
        first, *others = (line[span].strip() for span in spans)
        names = (lines[begin][span].strip() for span in spans[1:])
        rows[first] = dict(zip(names, others, strict=True))
    return rows


def test_the_table_says_who_caught_which_fault(capsys: pytest.CaptureFixture[str]) -> None:
    """And who missed one, which is not said of a fault that a benchmark does not claim to catch."""
    more = Injected(fault="armature", meaning="heavy", expected=False, broken=["angle"])
    other = SECTION.model_copy(update={"name": "other", "faults": [more]})
    none = SECTION.model_copy(update={"name": "none", "faults": []})
    lines = shown(capsys, RESULTS.model_copy(update={"sections": [SECTION, other, none]}))
    assert lines[-2:] == ["FAIL spin did not detect: the other way", "Not <compared>."]
    assert cells(lines[:-2], "caught faults") == {
        "spin": {
            **dict.fromkeys(("armature", "integrator", "erratum"), ""),
            **{"inertia": "caught", "held": "-", "sign": "MISSED"},
        },
        "other": {
            **dict.fromkeys(("sign", "integrator", "held", "erratum", "inertia"), ""),
            "armature": "caught",
        },
    }
    head = next(k for k, line in enumerate(lines) if line.startswith("caught faults"))
    assert lines[head - 1] == ""


def test_a_quick_table_has_no_faults_and_no_other_integrators(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert "Euler" in shown(capsys)[0]
    quick = shown(capsys, RESULTS.model_copy(update={"quick": True}))
    assert not any("Euler" in line or "caught faults" in line for line in quick)


def test_a_benchmark_is_named_once_and_each_quantity_has_its_verdict(
    capsys: pytest.CaptureFixture[str],
) -> None:
    other = SECTION.model_copy(update={"name": "other"})
    lines = shown(capsys, RESULTS.model_copy(update={"sections": [SECTION, other]}))
    rows = [line.split() for line in lines[1:7]]
    assert [row[0] for row in rows] == ["spin", "period", "lost", "other", "period", "lost"]
    verdicts = [[word for word in row if word in ("PASS", "FAIL")] for row in rows]
    assert verdicts == [["PASS"], ["FAIL"], ["FAIL"]] * 2


def test_brackets_are_no_markup(capsys: pytest.CaptureFixture[str]) -> None:
    """Rich takes what is in brackets for a style, and shows none of it."""
    row = Row.judged(Bound("rate [red]", "", 1.0, "by [bold]"), 0.5)
    fault = Injected(fault="sign", meaning="[dim]", expected=True, broken=[])
    section = SECTION.model_copy(update={"rows": [row], "faults": [fault]})
    text = "\n".join(
        shown(capsys, RESULTS.model_copy(update={"sections": [section], "remarks": ["see [b]"]}))
    )
    for part in ("rate [red]", "by [bold]", "did not detect: [dim]", "see [b]"):
        assert part in text


def terminal(monkeypatch: pytest.MonkeyPatch, columns: int) -> None:
    """Have the output taken for a terminal of that width, with colors."""
    for name, value in {"FORCE_COLOR": "1", "TERM": "xterm", "COLUMNS": str(columns)}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("NO_COLOR", raising=False)


@pytest.mark.parametrize(("columns", "reasons"), [(100, False), (149, False), (150, True)])
def test_reasons_are_for_a_wide_terminal(
    columns: int,
    reasons: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A file, which has no width, gets them too."""
    assert "why that bound" in shown(capsys)[0]
    terminal(monkeypatch, columns)
    lines = shown(capsys)
    assert ("why that bound" in lines[0]) is reasons
    assert any("as a | b" in line for line in lines) is reasons
    assert max(len(plain(line)) for line in lines) <= columns


def plain(line: str) -> str:
    return re.sub("\x1b[^m]*m", "", line)


def test_a_narrow_terminal_breaks_words_and_not_numbers(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    long = Bound("angle between the axis and its momentum", "rad", 1e-9, "because")
    rows = [Row.judged(long, -1.25e-12, {"Euler": 0.0123})]
    section = SECTION.model_copy(update={"name": "a-long-name", "rows": rows, "faults": []})
    terminal(monkeypatch, 85)
    lines = [
        plain(line) for line in shown(capsys, RESULTS.model_copy(update={"sections": [section]}))
    ]
    first = lines[1]
    for whole in ("a-long-name", "-1.2e-12", "0.012"):
        assert whole in first
    assert "momentum" in "".join(lines[2:])
    # Numbers stand below one another by their last digits, under the head.
    for head, number in (("measured", "-1.2e-12"), ("Euler", "0.012")):
        assert lines[0].index(head) + len(head) == first.index(number) + len(number)


YELLOW, DIM = "\x1b[33m", "\x1b[2m"


def test_only_what_is_judged_stands_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Other integrators are a warning, reasons are dim, and no number in a sentence is colored."""
    terminal(monkeypatch, 160)
    fault = Injected(fault="sign", meaning="by 3 rad", expected=True, broken=[])
    section = SECTION.model_copy(update={"faults": [fault]})
    update = {"sections": [section], "remarks": ["of 3 rad"]}
    lines = shown(capsys, RESULTS.model_copy(update=update))
    angle = lines[1]
    assert re.search(rf"{re.escape(YELLOW)} *0\.02", angle)
    assert re.search(rf"{re.escape(DIM)}as a \| b", angle)
    assert not re.search(r"\x1b[^m]*m *2e-12", angle)
    assert "of 3 rad" in lines
    (missed,) = (line for line in lines if "did not detect" in line)
    assert missed.endswith(" spin did not detect: by 3 rad")


ROWS = [
    Row.judged(Bound("energy", "", 1e-6, "keeps [it]"), 2.5e-7),
    Row.judged(Bound("momentum", "", 1e-9, "is kept"), 1.0),
]
PASSPORT = Passport(
    model="here/[x].xml",
    integrator="RK4",
    step=0.01,
    findings=[
        Finding(refused=True, text="automatic [reset] is on 1"),
        Finding(refused=False, text="heavy"),
    ],
    rows=ROWS,
    advice=["take [a] step of 0.02 s"],
    unjudged=["what rests on [y] 2"],
)


def test_a_passport_is_shown_whole(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    table.show_passport(PASSPORT)
    lines = capsys.readouterr().out.splitlines()
    assert lines[:3] == [
        "here/[x].xml: RK4, step 0.01 s",
        "refused: automatic [reset] is on 1",
        "warning: heavy",
    ]
    assert cells(lines[3:6], "quantity") == {
        "energy": {
            "measured": "2.5e-07",
            "allowed": "1e-06",
            "verdict": "PASS",
            "why that bound": "keeps [it]",
        },
        "momentum": {
            "measured": "1",
            "allowed": "1e-09",
            "verdict": "FAIL",
            "why that bound": "is kept",
        },
    }
    assert lines[6:] == ["not judged: what rests on [y] 2", "take [a] step of 0.02 s"]
    # What is long stays on one line, to be searched for and copied; its numbers are not colored.
    terminal(monkeypatch, 30)
    table.show_passport(PASSPORT)
    narrow = capsys.readouterr().out.splitlines()
    assert lines[0] in narrow
    assert any(line.endswith("m: what rests on [y] 2") for line in narrow)
